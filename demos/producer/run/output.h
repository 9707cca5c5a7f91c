#pragma once
/// The output of a render. Parses the argument OUT, handles existing files, and writes the manifest, which
/// makes it possible to resume a run.

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

/// Thrown if output exists and must not be overwritten, or if OUT is invalid.
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

/// Throws OutputError if the folder of a file has a # in its name, which is meant as a frame number, and does
/// not exist.
void check_folder(const std::filesystem::path& file);

/// Parses the argument OUT. Throws OutputError for an unknown ending. Also throws OutputError for a number
/// pattern of another program, such as f%04d.png; the message gives the equivalent pattern with #.
OutputTarget parse_output(const std::string& out);

/// Converts a number pattern of another program (%04d, $F4 or {:04}) to a pattern with #. Returns an empty
/// text for any other text.
std::string hash_pattern(const std::string& pattern);

/// Description of the film whose frames are in a folder.
struct Manifest {
  std::string scene;     ///< name of the scene
  std::string settings;  ///< settings_key() of the scene
  int width_px = 0, height_px = 0, frames = 0;
  render::FrameRate fps;
};

/// Returns a frame rate in JSON: an integer as a number, any other rate as a fraction such as "30000/1001".
nlohmann::ordered_json fps_json(const render::FrameRate& fps);

/// The channels and formats to write, and the common part of the names of their files. '#' in the stem stands
/// for the frame number, as in render::frame_path.
struct ChannelFiles {
  render::ChannelChoice choice;
  std::filesystem::path stem;

  std::vector<std::filesystem::path> of(int frame) const {
    return render::channel_files(render::frame_path(stem, frame), choice);
  }
};

/// Returns the stem of the channel files that belong to a pattern of frames. If the frames themselves are EXR
/// files, the stem has a suffix, so that channel files get other names than frames.
std::filesystem::path channels_stem(const std::filesystem::path& pattern);

/// Returns the names of all channel files that a frame may have, in all formats.
std::vector<std::filesystem::path> all_channel_files(const std::filesystem::path& stem, int frame);

enum class Existing { refuse, keep, replace };

/// A locked folder of frames. Either only this run writes to the folder, or it shares the folder with runs
/// that draw other frames of the same film.
struct FrameFolder {
  OutputLock lock;
  std::vector<int> missing;  ///< frames to be drawn
};

/// Prepares a folder of frames: locks it, checks or writes the manifest, and finds the frames to be drawn.
/// - Existing::refuse: existing frames are an error.
/// - Existing::keep: frames with the settings of this run and with all channel files are kept. Incomplete
///   frames are drawn again. Frames with other settings, and files that are not frames of a film, are an
///   error.
/// - Existing::replace: existing frames are drawn again. Frames with other settings are removed before the
///   new manifest is written.
///
/// Throws OutputError for these errors and if another process writes to the folder. Throws FileError if a
/// file cannot be written.
FrameFolder prepare_frames(const std::filesystem::path& pattern, const ChannelFiles& channels,
                           const std::vector<int>& frames, const Manifest& manifest, Existing existing);

/// Returns the existing files of the film that the manifest of a folder describes: the frames, their
/// channels, and the manifest itself.
std::vector<std::filesystem::path> files_of_frames(const std::filesystem::path& folder);

/// Removes the files of files_of_frames(), and the folder if it is then empty.
void remove_frames(const std::filesystem::path& folder);

/// Returns the folder for the channels of a video: FILM.channels.
std::filesystem::path channels_folder(const std::filesystem::path& video);

/// Returns whether a folder contains channel files, which then belong to an earlier film.
bool holds_channels(const std::filesystem::path& folder);

/// Removes all channel files of any frame and format, and the folder if it is then empty.
void remove_channels(const std::filesystem::path& folder);

/// Creates the folder for the channels of a video. With `replace`, removes existing channels; otherwise
/// throws OutputError if the folder is not empty. Throws FileError if the folder cannot be created.
void prepare_channels(const std::filesystem::path& folder, bool replace);

/// Returns the frame number in a file name that matches a pattern; nothing if the name does not match.
std::optional<int> frame_number(const std::filesystem::path& pattern, const std::filesystem::path& file);

}  // namespace offstage::producer
