#pragma once
/// Image-hash regression: a golden keeps, for a few frames of a scene drawn small, the hash of the
/// simulation's state, the hash of the pixels, and the picture itself. State first: if it is equal and the
/// pixels differ, it is the renderer that changed.

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "producer/format/scene_io.h"
#include "producer/run/production.h"
#include "render/image.h"

namespace offstage::producer {

/// The settings goldens are drawn with, as overrides of the scene.
std::vector<std::string> golden_overrides();

struct GoldenFrame {
  int frame = 0;
  std::string state_hash, pixel_hash;
  render::Image image;
};

struct Golden {
  std::string scene;   ///< the name, which its files begin with
  std::string source;  ///< the scene's file, relative to the folder of goldens; empty: not recorded
  std::string reason, fingerprint;
  std::vector<GoldenFrame> frames;
};

/// Where states of a simulation are kept between two drawings of a golden; empty: nowhere.
struct GoldenStates {
  std::string keep;  ///< folder that the states of the golden frames are written to
  std::string from;  ///< folder that they are read from, instead of simulating
};

/// Which golden of a folder belongs to a scene file. A golden records the file it was made of, so two scenes
/// of one name in different folders have two goldens: the second is named after its folder and file, too.
struct GoldenPlace {
  std::string name;        ///< of the golden's files
  std::string source;      ///< of the scene, relative to the folder, with links resolved
  bool exists = false;     ///< it is there and belongs to this scene
  std::string moved_from;  ///< the golden's source, if that is gone: it is taken for this scene moved
};
/// Finds it by its source, else by the scene's name if the golden there records no source or one that is
/// gone. Else a name for a new golden that no other has. `taken` are names that are already given away.
/// Throws FileError for a folder that cannot be read, or if no name is free.
GoldenPlace find_golden(const std::filesystem::path& folder, const LoadedScene& scene,
                        const std::filesystem::path& scene_file, const std::set<std::string>& taken = {});

/// Draws the golden frames of a scene that was loaded with golden_overrides(): one early, one late. Throws
/// Interrupted.
Golden draw_golden(const LoadedScene& scene, int threads, const GoldenStates& states = {},
                   const ProgressCallback& progress = {});

/// Reads and writes FOLDER/<name>.json and its pictures FOLDER/<name>-####.png. Throws FileError.
Golden read_golden(const std::filesystem::path& folder, const std::string& name);
void write_golden(const std::filesystem::path& folder, const Golden& golden);

struct Verdict {
  bool pass = true;
  std::string text;        ///< what was found, one line per frame
  std::string difference;  ///< the first line about a difference; empty if there is none
};

/// Compares; with the same fingerprint exactly, else within the tolerance.
Verdict judge(const Golden& expected, const Golden& actual);

/// Writes expected, actual and amplified difference of every frame and a page that shows them; returns the
/// page.
std::filesystem::path write_report(const std::filesystem::path& folder, const Golden& expected,
                                   const Golden& actual, const Verdict& verdict);

}  // namespace offstage::producer
