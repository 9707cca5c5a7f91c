#pragma once
/// Image-hash regression: for a few frames of a scene drawn small, a golden stores the hash of the
/// simulation's state, the hash of the pixels, and the picture itself. The state is compared first: if it is
/// equal and the pixels differ, the renderer has changed.

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "producer/format/scene_io.h"
#include "producer/run/production.h"
#include "render/image.h"

namespace offstage::producer {

/// The settings of goldens, as overrides of the scene.
std::vector<std::string> golden_overrides();

struct GoldenFrame {
  int frame = 0;
  std::string state_hash, pixel_hash;
  render::Image image;
};

struct Golden {
  std::string scene;   ///< name of the golden, with which the names of its files begin
  std::string source;  ///< the scene's file, relative to the folder of goldens; empty: not recorded
  std::string reason, fingerprint;
  std::vector<GoldenFrame> frames;
};

/// Folders with the simulated states of a golden's frames, so that they can be drawn again without
/// simulation; empty: none.
struct GoldenStates {
  std::string keep;  ///< folder to which the states of the golden frames are written
  std::string from;  ///< folder from which the states are read, instead of simulating
};

/// The golden of a scene file in a folder. A golden records its scene file, so two scenes of the same name in
/// different folders have two goldens; the second one is named after its folder and file.
struct GoldenPlace {
  std::string name;     ///< name of the golden's files
  std::string source;   ///< path of the scene, relative to the folder, with links resolved
  bool exists = false;  ///< whether the golden exists and belongs to this scene
  /// Source of the golden, if that file does not exist any more: the scene is assumed to have been moved.
  std::string moved_from;
};
/// Finds the golden by its source, else by the scene's name if the golden of that name has no source or one
/// that does not exist any more. Otherwise the result is an unused name for a new golden. `taken` are names
/// that are already in use. Throws FileError for a folder that cannot be read, or if no name is free.
GoldenPlace find_golden(const std::filesystem::path& folder, const LoadedScene& scene,
                        const std::filesystem::path& scene_file, const std::set<std::string>& taken = {});

/// Draws the golden frames of a scene that was loaded with golden_overrides(): an early and a late one.
/// Throws Interrupted.
Golden draw_golden(const LoadedScene& scene, int threads, const GoldenStates& states = {},
                   const ProgressCallback& progress = {});

/// Reads and writes FOLDER/<name>.json and its pictures FOLDER/<name>-####.png. Throws FileError.
Golden read_golden(const std::filesystem::path& folder, const std::string& name);
void write_golden(const std::filesystem::path& folder, const Golden& golden);

struct Verdict {
  bool pass = true;
  std::string text;        ///< result, one line per frame
  std::string difference;  ///< the first line about a difference; empty if there is none
};

/// Compares two goldens: exactly for the same fingerprint, otherwise within the tolerance.
Verdict judge(const Golden& expected, const Golden& actual);

/// Writes the expected image, the actual image and the amplified difference of each frame, and an HTML page;
/// returns the path of the page.
std::filesystem::path write_report(const std::filesystem::path& folder, const Golden& expected,
                                   const Golden& actual, const Verdict& verdict);

}  // namespace offstage::producer
