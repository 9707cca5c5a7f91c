#pragma once
/// Output of a render: the meaning of OUT, existing files, and the manifest with which a run can be resumed.

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

/// Output exists and may not be overwritten, or OUT is invalid.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class OutputKind {
  frames,  ///< a pattern with #, or a folder: one PNG, JPEG or EXR per frame
  video,   ///< .mp4 .webm .mov .mkv .gif .webp .apng .png
  pipe,    ///< "-": raw frames on standard output
};

struct OutputTarget {
  OutputKind kind = OutputKind::frames;
  std::filesystem::path path;  ///< pattern of the frames, or file of the video
};

/// Throws OutputError for an unknown ending, and for the number patterns of other programs (f%04d.png), with
/// the equivalent pattern.
OutputTarget parse_output(const std::string& out);

/// Converts a pattern of another program (%04d of C, $F4, {:04}) to one with #. Empty if it is not such a
/// pattern.
std::string hash_pattern(const std::string& pattern);

/// Identifies the frames in a folder.
struct Manifest {
  std::string scene;     ///< name of the scene
  std::string settings;  ///< its settings_key()
  int width_px = 0, height_px = 0, frames = 0;
  render::FrameRate fps;
};

/// A frame rate in JSON: a number if it is an integer, else a fraction such as "30000/1001".
nlohmann::ordered_json fps_json(const render::FrameRate& fps);

/// Kinds and stem of the channel files; '#' in the stem stands for the frame number, as in
/// render::frame_path.
struct ChannelFiles {
  render::ChannelChoice choice;
  std::filesystem::path stem;

  std::vector<std::filesystem::path> of(int frame) const {
    return render::channel_files(render::frame_path(stem, frame), choice);
  }
};

/// Returns the stem of the channel files of a frame pattern. If the frames themselves are EXR files, a suffix
/// keeps the names distinct.
std::filesystem::path channels_stem(const std::filesystem::path& pattern);

/// Files of all channels and formats that a frame may have.
std::vector<std::filesystem::path> all_channel_files(const std::filesystem::path& stem, int frame);

enum class Existing { refuse, keep, replace };

/// A folder of frames that only this run writes, or which it shares with runs that draw other frames of the
/// same film.
struct FrameFolder {
  OutputLock lock;
  std::vector<int> missing;  ///< frames to be drawn
};

/// Prepares a folder of frames: locks it, checks or writes the manifest, and finds the frames to be drawn. A
/// frame is kept if it has the settings of this run. Frames with other settings are never mixed in: they are
/// refused or, with Existing::replace, removed before the new manifest is written. Files that are not frames
/// of a film are refused, too, unless they are to be replaced. Throws OutputError, also if another process
/// writes there, or FileError. `channels` belong to the frames: a frame without one of its channel files is
/// drawn again.
FrameFolder prepare_frames(const std::filesystem::path& pattern, const ChannelFiles& channels,
                           const std::vector<int>& frames, const Manifest& manifest, Existing existing);

/// Returns the files that the manifest of a folder lists: frames, their channels, the manifest itself.
std::vector<std::filesystem::path> files_of_frames(const std::filesystem::path& folder);

/// Removes exactly these files, and the folder if it is then empty.
void remove_frames(const std::filesystem::path& folder);

/// Folder of the channels of a video: FILM.channels.
std::filesystem::path channels_folder(const std::filesystem::path& video);

/// Whether a folder contains channels of an earlier film.
bool holds_channels(const std::filesystem::path& folder);

/// Removes all channel files of any frame and format, and the folder if it is then empty.
void remove_channels(const std::filesystem::path& folder);

/// Creates the folder for the channels of a video. Existing channels are refused or, with `replace`, removed.
void prepare_channels(const std::filesystem::path& folder, bool replace);

/// Returns the number in a file name that matches a pattern; nothing for other files.
std::optional<int> frame_number(const std::filesystem::path& pattern, const std::filesystem::path& file);

}  // namespace offstage::producer
