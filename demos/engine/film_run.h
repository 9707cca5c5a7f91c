#pragma once
/// The film of one version of a scene. It is simulated frame by frame and drawn as small drafts; single
/// frames are refined to full size. All work is done on the calling thread, which owns the GL context. Each
/// call processes at most one frame.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "engine/frame_store.h"
#include "engine/jpeg.h"
#include "engine/simulated_film.h"
#include "producer/build/models.h"
#include "producer/build/picture.h"
#include "producer/format/scene_io.h"
#include "render/context.h"

namespace offstage::engine {

/// A camera that replaces the camera of the scene, so that the user can look around. Both points are in the
/// world [m].
struct ViewCamera {
  Eigen::Vector3d eye, target;
  bool operator==(const ViewCamera& other) const { return eye == other.eye && target == other.target; }
};

/// A version of a scene, and the keys of its pictures and its states in the stores.
struct FilmDef {
  std::shared_ptr<const producer::LoadedScene> loaded;
  std::optional<ViewCamera> camera;
  std::string film;     ///< key of the pictures in the FrameStore
  std::string physics;  ///< key of the states in the PhysicsStore
};

/// The resources that all films of a session share.
struct FilmResources {
  PhysicsStore& physics;
  FrameStore& frames;
  render::Context& context;
  JpegWriter& jpeg;
  Eigen::Vector2i draft_px;  ///< largest width and height of a draft [px]
};

class FilmRun {
 public:
  using Stop = std::function<bool()>;

  /// Builds the film and its simulation. Throws the exceptions of the constructor of producer::Simulation.
  FilmRun(FilmDef def, std::shared_ptr<const producer::ModelLibrary> models, const FilmResources& resources);

  const FilmDef& def() const { return def_; }
  int frames() const { return scene_.frame_count(); }
  /// Changes the camera; null selects the scene's own camera. The states are kept. `film` is the key of the
  /// pictures with the new camera.
  void look_from(const std::optional<ViewCamera>& camera, const std::string& film);

  bool has_state(int frame) const { return simulated_.has_state(frame); }
  bool has_draft(int frame) const { return resources_.frames.has(def_.film, frame, Detail::draft); }
  /// Returns the first frame without a draft, or frames() + 1 if all frames have one.
  int first_missing();

  SimulatedFilm& simulated() { return simulated_; }
  const Physics& physics() const { return simulated_.physics(); }
  // The next three functions return false and store no picture if `stop` returned true while they were
  // drawing. `stop` is called from several threads.
  /// Draws a draft of a frame and puts it into the store. The state of the frame must be available.
  bool draw_draft(int frame, const Stop& stop);
  /// Draws the current state of the simulation and puts the draft into the store as frame 0, while frame 1 is
  /// not yet reached.
  bool draw_lead_in(const Stop& stop);
  /// Draws a frame at full size and puts it into the store. The state of the frame must be available.
  bool refine(int frame, Detail detail, const Stop& stop);
  /// Returns the name of the object that is visible at a position of a frame; empty if there is none. x and y
  /// are fractions of the width and the height, from the top left corner. The state of the frame must be
  /// available.
  std::string pick(int frame, double x, double y);
  /// Returns a picture of draft size without storing it. The state of the frame must be available.
  render::Image small_picture(int frame) { return draft_picture().draw(previous(frame), state(frame)); }

  const producer::Scene& scene() const { return scene_; }

 private:
  struct Refined {
    producer::Scene scene;
    std::optional<producer::Picture> picture;  // declared after the scene, to which it refers
  };

  producer::Picture& draft_picture();
  bool draw_draft(int frame, const producer::Snapshot& before, const producer::Snapshot& now,
                  const Stop& stop);
  const producer::Snapshot& state(int frame) const { return simulated_.state(frame); }
  const producer::Snapshot& previous(int frame) const {
    return frame > 1 && has_state(frame - 1) ? state(frame - 1) : state(frame);
  }

  FilmDef def_;
  std::shared_ptr<const producer::ModelLibrary> models_;
  FilmResources resources_;
  producer::Scene scene_;  // the scene with the size and quality of drafts
  SimulatedFilm simulated_;
  std::optional<producer::Picture> picture_;
  std::unique_ptr<Refined> refined_;
  render::Camera camera_;
  int missing_hint_ = 1;
};

}  // namespace offstage::engine
