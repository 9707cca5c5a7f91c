#pragma once
/// Regression tests of pictures. A golden belongs to a scene. For a few frames, drawn small, it stores the
/// picture, the hash of its pixels, and the hash of the simulation's state. States are compared first: if
/// they are equal and the pixels differ, the renderer has changed.

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "producer/format/scene_io.h"
#include "producer/run/production.h"
#include "render/image.h"

namespace offstage::producer {

/// Returns the settings with which goldens are drawn, as overrides of the scene.
std::vector<std::string> golden_overrides();

struct GoldenFrame {
  int frame = 0;
  std::string state_hash, pixel_hash;
  render::Image image;
};

struct Golden {
  std::string scene;   ///< name of the golden, with which the names of its files begin
  std::string source;  ///< the scene's file, relative to the folder of goldens; empty: not recorded
  /// Reason for the latest change of the golden, and fingerprint of the machine that drew it.
  std::string reason, fingerprint;
  std::vector<GoldenFrame> frames;
};

/// Folders with the simulated states of a golden's frames and the convex decompositions of its models. With
/// them, the frames can be drawn again without simulation. An empty name means no folder.
struct GoldenStates {
  std::string keep;  ///< folder to which both are written, in the subfolders `states` and `parts`
  std::string from;  ///< folder from which both are read, instead of simulating
};

/// The golden of a scene file, in a folder of goldens. Each golden records its scene file. Two scenes of the
/// same name in different folders therefore have two goldens; the name of the second golden contains the
/// names of the scene's folder and file.
struct GoldenPlace {
  std::string name;     ///< name of the golden's files
  std::string source;   ///< path of the scene, relative to the folder, with links resolved
  bool exists = false;  ///< whether the golden exists and belongs to this scene
  /// Source that the golden records, if that file no longer exists. The scene was probably moved from there.
  /// Empty: the scene was not moved.
  std::string moved_from;
};
/// Finds the golden that records the scene file as its source. If there is none, takes the golden that has
/// the scene's name, provided that it has no source or its source no longer exists. If there is none either,
/// returns an unused name for a new golden. `taken`: further names that are in use. Throws FileError for a
/// folder that cannot be read, or if no name is free.
GoldenPlace find_golden(const std::filesystem::path& folder, const LoadedScene& scene,
                        const std::filesystem::path& scene_file, const std::set<std::string>& taken = {});

/// Draws frames of a scene, which must have been loaded with golden_overrides(). `frames`: numbers of the
/// frames in ascending order, from 1; those that the scene does not have are left out. Without any, the
/// frames at a fifth and at three fifths of the scene are drawn. Throws Interrupted after a signal.
Golden draw_golden(const LoadedScene& scene, const std::vector<int>& frames, int threads,
                   const GoldenStates& states = {}, const ProgressCallback& progress = {});
/// Numbers of the frames that the golden of this name records; none if there is no golden.
std::vector<int> recorded_frames(const std::filesystem::path& folder, const std::string& name);
/// Numbers of the frames of a golden.
std::vector<int> frames_of(const Golden& golden);

/// Read and write the file FOLDER/<name>.json and the pictures FOLDER/<name>-####.png. Writing removes the
/// pictures of frames that the golden no longer has. Both throw FileError.
Golden read_golden(const std::filesystem::path& folder, const std::string& name);
void write_golden(const std::filesystem::path& folder, const Golden& golden);

struct Verdict {
  bool pass = true;
  std::string text;        ///< result of the comparison, one line per frame
  std::string difference;  ///< the first line of `text` about a difference; empty if there is none
};

/// Compares two goldens. The comparison is exact if their fingerprints are equal; otherwise it has a
/// tolerance.
Verdict judge(const Golden& expected, const Golden& actual);

/// Writes an HTML page about a comparison to a folder, and returns the path of the page. For each frame, also
/// writes the expected image, the actual image and their amplified difference.
std::filesystem::path write_report(const std::filesystem::path& folder, const Golden& expected,
                                   const Golden& actual, const Verdict& verdict);

}  // namespace offstage::producer
