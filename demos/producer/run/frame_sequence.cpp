#include "producer/run/frame_sequence.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "producer/run/output.h"
#include "render/error.h"
#include "render/frame_files.h"
#include "render/sink.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

/// Returns the pattern to which a file name belongs: its last group of digits is replaced by #. For example,
/// shot_0007.png gives shot_####.png. Returns an empty text for a name without digits.
std::string pattern_of(const std::string& name) {
  const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  const auto last = std::find_if(name.rbegin(), name.rend(), is_digit);
  if (last == name.rend()) return {};
  const auto first = std::find_if_not(last, name.rend(), is_digit);
  std::string pattern = name;
  std::fill(pattern.begin() + (name.rend() - first), pattern.begin() + (name.rend() - last), '#');
  return pattern;
}

/// Returns whether a file has a format of which a video can be made.
bool is_displayed(const fs::path& path) {
  const auto format = render::frame_format(path);
  return format == render::FrameFormat::png || format == render::FrameFormat::jpeg;
}

/// Returns the pattern to which most pictures of a folder belong. Messages give it as advice.
std::string usual_pattern(const fs::path& folder) {
  std::map<std::string, int> counts;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (is_displayed(entry.path()))
      if (const std::string pattern = pattern_of(entry.path().filename().string()); !pattern.empty())
        ++counts[pattern];
  const auto most = std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; });
  return most == counts.end() ? "" : most->first;
}

fs::path checked_pattern(const std::string& text) {
  if (const std::string meant = hash_pattern(text); !meant.empty())
    throw OutputError(text + ": write the frame number as #; did you mean '" + meant + "'?");
  if (text.ends_with('/') || fs::is_directory(text)) return fs::path(text) / "####.png";
  const fs::path path = text;
  if (!is_displayed(path))
    throw OutputError(text +
                      ": a video is made of PNG or JPEG files; give a pattern such as 'frames/####.png'");
  const std::string name = path.filename().string();
  if (name.find('#') == std::string::npos) {
    const std::string pattern = name.find('*') != std::string::npos ? "####.png" : pattern_of(name);
    throw OutputError(
        fmt::format("{}: write the frame number as #; {} '{}'{}", text,
                    pattern.empty() ? "give a pattern such as" : "did you mean",
                    pattern.empty() ? "frames/####.png" : (path.parent_path() / pattern).string(),
                    pattern.empty() ? "" : "?"));
  }
  return path;
}

/// Throws FileError unless the file is complete.
render::FrameFile checked_frame(const fs::path& path) {
  if (const auto file = render::inspect_frame(path)) return *file;
  const bool png = render::frame_format(path) == render::FrameFormat::png;
  throw render::FileError(path.string() + ": is not a complete " + (png ? "PNG" : "JPEG") + " file");
}

void check_gaps(const FrameSequence& sequence) {
  const auto& frames = sequence.frames;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (frames[i].number == frames[i - 1].number + 1) continue;
    const std::string missing = render::frame_path(sequence.pattern, frames[i - 1].number + 1).string();
    const int more = sequence.left_out - 1;
    throw render::FileError(fmt::format(
        "{}: frame {} is missing{}; the frames go from {} to {}. Skip missing frames with --allow-gaps",
        missing, frames[i - 1].number + 1, more > 0 ? fmt::format(" (and {} more)", more) : "",
        frames.front().number, frames.back().number));
  }
}

}  // namespace

FrameSequence find_sequence(const std::string& text, bool allow_gaps) {
  FrameSequence sequence{.pattern = checked_pattern(text), .frames = {}};
  const fs::path folder = sequence.pattern.has_parent_path() ? sequence.pattern.parent_path() : ".";
  if (!fs::is_directory(folder)) throw render::FileError(folder.string() + ": there is no such folder");
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path file = sequence.pattern.parent_path() / entry.path().filename();
    if (const auto number = frame_number(sequence.pattern, file)) sequence.frames.push_back({*number, file});
  }
  if (sequence.frames.empty()) {
    const std::string usual = usual_pattern(folder);
    throw render::FileError(fmt::format(
        "{}: no file matches this pattern{}", sequence.pattern.string(),
        usual.empty() ? "" : "; did you mean '" + (sequence.pattern.parent_path() / usual).string() + "'?"));
  }
  std::ranges::sort(sequence.frames, {}, &SequenceFrame::number);
  sequence.left_out = sequence.frames.back().number - sequence.frames.front().number + 1 -
                      static_cast<int>(sequence.frames.size());
  if (!allow_gaps) check_gaps(sequence);
  for (const SequenceFrame& frame : sequence.frames) {
    const render::FrameFile head = checked_frame(frame.path);
    if (sequence.width_px == 0) {
      sequence.width_px = head.width_px;
      sequence.height_px = head.height_px;
    }
    if (head.width_px != sequence.width_px || head.height_px != sequence.height_px)
      throw render::FileError(
          fmt::format("{}: is {}x{}, but frame {} is {}x{}; all frames of a video must have the same size",
                      frame.path.string(), head.width_px, head.height_px, sequence.frames.front().number,
                      sequence.width_px, sequence.height_px));
    sequence.may_be_transparent |= head.alpha;
  }
  return sequence;
}

}  // namespace offstage::producer
