#pragma once
/// Options that several commands share.

#include <optional>
#include <string>
#include <vector>

#include "producer/build/decomposition_cache.h"
#include "producer/format/scene_source.h"
#include "producer/run/progress.h"
#include "render/context.h"

namespace CLI {
class App;
}

namespace offstage::producer {

/// Options of every command that reads a scene.
struct SceneOptions {
  std::string file;
  std::vector<std::string> set;
  std::optional<std::string> quality, size;
  std::optional<std::string> fps;  ///< a number, or a fraction such as 30000/1001
  std::optional<double> duration;
  std::optional<uint64_t> seed;
  /// Channels: depth, normal, id, motion. Empty: the channels of the scene.
  std::vector<std::string> channels;
  std::optional<std::string> channel_format;
  std::string camera;              ///< name of the camera to draw; empty: the scene's `camera`
  std::vector<std::string> allow;  ///< additional folders for the scene's files
  bool no_cache = false;           ///< whether to ignore the cache of convex parts, and not to write it

  DecompositionCache decompositions() const {
    return no_cache ? DecompositionCache() : DecompositionCache::of_user();
  }
  /// Returns the overrides of the scene: first the values of options such as --fps, then `set`. Throws
  /// std::invalid_argument for an invalid value.
  std::vector<std::string> overrides() const;
  bool from_standard_input() const { return file == kStandardInput; }
};

struct LogOptions {
  ProgressStyle progress = ProgressStyle::automatic;
  bool quiet = false, verbose = false;
};

// Each function adds options to a command. Their parsed values are stored in the last argument.
void add_allow(CLI::App& command, std::vector<std::string>& allow);
/// Adds the options that override values of the scene and its seed, and that allow further folders.
/// add_scene() also adds the argument for the scene file.
void add_overrides(CLI::App& command, SceneOptions& scene);
void add_scene(CLI::App& command, SceneOptions& scene);
void add_timing(CLI::App& command, SceneOptions& scene);
void add_quality(CLI::App& command, SceneOptions& scene);
/// Adds the options for quality and size of a whole picture (add_picture), or of each small picture of a
/// contact sheet (add_small_picture).
void add_picture(CLI::App& command, SceneOptions& scene);
void add_small_picture(CLI::App& command, SceneOptions& scene);
void add_log_options(CLI::App& command, LogOptions& log_options);
void add_channels(CLI::App& app, SceneOptions& scene);
void add_gl(CLI::App& command, render::GlPlatform& gl);
void add_threads(CLI::App& command, int& threads);
void add_camera(CLI::App& command, SceneOptions& scene);

}  // namespace offstage::producer
