#pragma once
/// Image-hash regression: a golden keeps, for a few frames of a scene drawn small, the hash of the
/// simulation's state, the hash of the pixels, and the picture itself. State first: if it is equal and the
/// pixels differ, it is the renderer that changed.

#include <filesystem>
#include <string>
#include <vector>

#include "producer/scene_io.h"
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
  std::string scene, reason, fingerprint;
  std::vector<GoldenFrame> frames;
};

/// Draws the golden frames of a scene that was loaded with golden_overrides(): one early, one late. Throws
/// Interrupted.
Golden draw_golden(const LoadedScene& scene, int threads);

/// Reads and writes FOLDER/<scene>.json and its pictures FOLDER/<scene>-####.png. Throws FileError.
Golden read_golden(const std::filesystem::path& folder, const std::string& scene);
void write_golden(const std::filesystem::path& folder, const Golden& golden);

struct Verdict {
  bool pass = true;
  std::string text;  ///< what was found, one line per frame
};

/// Compares; with the same fingerprint exactly, else within the tolerance.
Verdict judge(const Golden& expected, const Golden& actual);

/// Writes expected, actual and amplified difference of every frame and a page that shows them; returns the
/// page.
std::filesystem::path write_report(const std::filesystem::path& folder, const Golden& expected,
                                   const Golden& actual, const Verdict& verdict);

}  // namespace offstage::producer
