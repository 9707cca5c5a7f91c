#pragma once
/// The film of one version of a scene: it is simulated frame by frame, drawn small, and single frames are
/// refined. All work is done on the calling thread, which owns the GL context, in pieces of one frame.

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

/// A camera that replaces the scene's, to look around.
struct ViewCamera {
  Eigen::Vector3d eye, target;
  bool operator==(const ViewCamera& other) const { return eye == other.eye && target == other.target; }
};

/// A version of a scene, with the keys under which the stores have its pictures and its states.
struct FilmDef {
  std::shared_ptr<const producer::LoadedScene> loaded;
  std::optional<ViewCamera> camera;
  std::string film;     ///< key of its pictures in the FrameStore
  std::string physics;  ///< key of its states in the PhysicsStore
};

/// Stores, GL context and JPEG encoder, which the films of a session share.
struct FilmResources {
  PhysicsStore& physics;
  FrameStore& frames;
  render::Context& context;
  JpegWriter& jpeg;
  Eigen::Vector2i draft_px;  ///< greatest size of a draft [px]
};

class FilmRun {
 public:
  using Stop = std::function<bool()>;

  /// Throws what the constructor of producer::Simulation throws.
  FilmRun(FilmDef def, std::shared_ptr<const producer::ModelLibrary> models, const FilmResources& resources);

  const FilmDef& def() const { return def_; }
  int frames() const { return scene_.frame_count(); }
  /// Uses another camera for the same film. The states are kept; `film` is the key of the new pictures.
  void look_from(const std::optional<ViewCamera>& camera, const std::string& film);

  bool has_state(int frame) const { return simulated_.has_state(frame); }
  bool has_draft(int frame) const { return resources_.frames.has(def_.film, frame, Detail::draft); }
  /// The first frame without a draft; frames() + 1 if there is none.
  int first_missing();

  SimulatedFilm& simulated() { return simulated_; }
  const Physics& physics() const { return simulated_.physics(); }
  // These return false, without a picture, if `stop` returned true meanwhile; several threads call it.
  /// Draws a draft of a frame whose state is available, into the store.
  bool draw_draft(int frame, const Stop& stop);
  /// Draws the current state before frame 1 as frame 0.
  bool draw_lead_in(const Stop& stop);
  /// Draws a frame whose state is available at full size.
  bool refine(int frame, Detail detail, const Stop& stop);
  /// Name of the visible object at a position of a frame, or empty. The position is a fraction of width and
  /// height, from the top left corner. The state must be available.
  std::string pick(int frame, double x, double y);
  /// A small picture for a sheet; the state must be available.
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
  producer::Scene scene_;  // as used for drafts
  SimulatedFilm simulated_;
  std::optional<producer::Picture> picture_;
  std::unique_ptr<Refined> refined_;
  render::Camera camera_;
  int missing_hint_ = 1;
};

}  // namespace offstage::engine
