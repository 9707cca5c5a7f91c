#pragma once
/// Where a render goes: what OUT means, what is already there, and the manifest that lets a run be resumed.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "producer/format/scene_io.h"
#include "producer/run/output_lock.h"
#include "render/channels.h"
#include "render/sink.h"

namespace offstage::producer {

/// Output exists and may not be overwritten, or OUT cannot be what it says.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class OutputKind {
  frames,  ///< a pattern with #, or a folder: one PNG per frame
  video,   ///< .mp4 .webm .mov .mkv .gif .webp .apng .png
  pipe,    ///< "-": raw frames on standard output
};

struct OutputTarget {
  OutputKind kind = OutputKind::frames;
  std::filesystem::path path;  ///< the pattern of frames, or the video
};

/// Throws OutputError for an ending that is none of the known ones, and for the number patterns of other
/// programs (f%04d.png), with the pattern that is meant.
OutputTarget parse_output(const std::string& out);

/// The pattern with # that a pattern of another program means: %04d of C, $F4, {:04}. Empty if it is none.
std::string hash_pattern(const std::string& pattern);

/// What identifies the frames in a folder.
struct Manifest {
  std::string scene, settings;  ///< name; settings_key()
  int width_px = 0, height_px = 0, frames = 0;
  render::FrameRate fps;
};

/// A frame rate as it stands in JSON: a number if it is whole, else a fraction such as "30000/1001".
nlohmann::ordered_json fps_json(const render::FrameRate& fps);

/// Files with channels: which, and how their names begin, with '#' as in render::frame_path.
struct ChannelFiles {
  render::ChannelChoice choice;
  std::filesystem::path stem;

  std::vector<std::filesystem::path> of(int frame) const {
    return render::channel_files(render::frame_path(stem, frame), choice);
  }
};

/// Those of every channel and format that a frame may have.
std::vector<std::filesystem::path> all_channel_files(const std::filesystem::path& stem, int frame);

enum class Existing { refuse, keep, replace };

/// A folder of frames that only this run writes, or this one and others that draw other frames of the same
/// film.
struct FrameFolder {
  OutputLock lock;
  std::vector<int> missing;  ///< frames that have to be drawn
};

/// Prepares a folder of frames: locks it, checks or writes the manifest and finds the frames that have to be
/// drawn. A frame is kept if it carries the settings of this run. Frames of other settings are never mixed
/// in: they are refused, or removed with Existing::replace before the new manifest stands. Files that are no
/// frames of a film are refused, too, unless they are to be replaced. Throws OutputError, also if another
/// process writes there, or FileError. `channels` belong to the frames: one that lacks a file of theirs is
/// drawn again.
FrameFolder prepare_frames(const std::filesystem::path& pattern, const ChannelFiles& channels,
                           const std::vector<int>& frames, const Manifest& manifest, Existing existing);

/// The files in a folder that the manifest of its frames names: frames, their channels, the manifest itself.
std::vector<std::filesystem::path> files_of_frames(const std::filesystem::path& folder);

/// Removes exactly those, and the folder if nothing else is in it.
void remove_frames(const std::filesystem::path& folder);

/// Where the channels of a video go: FILM.channels.
std::filesystem::path channels_folder(const std::filesystem::path& video);

/// Whether there are channels of an earlier film.
bool holds_channels(const std::filesystem::path& folder);

/// Removes them, whatever their frames and format, and the folder unless it holds something else.
void remove_channels(const std::filesystem::path& folder);

/// Makes the folder for the channels of a video. Those that are there are refused, or removed to be replaced.
void prepare_channels(const std::filesystem::path& folder, bool replace);

/// Whether a file is a complete PNG of this size.
bool is_whole_png(const std::filesystem::path& path, int width_px, int height_px);

/// The number in a file name that fits a pattern; nothing for other files.
std::optional<int> frame_number(const std::filesystem::path& pattern, const std::filesystem::path& file);

}  // namespace offstage::producer
