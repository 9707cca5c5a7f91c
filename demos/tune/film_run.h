#pragma once
/// The film of one version of a scene: it is simulated frame by frame, drawn small, and single frames are
/// refined. All work is done on the calling thread, which owns the GL context, in pieces of one frame.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "producer/build/models.h"
#include "producer/build/picture.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"
#include "render/context.h"
#include "tune/frame_store.h"
#include "tune/jpeg.h"

namespace offstage::tune {

/// A camera that replaces the scene's, to look around.
struct ViewCamera {
  Eigen::Vector3d eye, target;
  bool operator==(const ViewCamera& other) const { return eye == other.eye && target == other.target; }
};

/// A version of a scene, with the keys of its pictures and its physics.
struct FilmDef {
  std::shared_ptr<const producer::LoadedScene> loaded;
  std::optional<ViewCamera> camera;
  std::string film;     ///< key of its pictures
  std::string physics;  ///< key of its states
};

/// Data shared by the films of a session.
struct Workshop {
  PhysicsStore& physics;
  FrameStore& frames;
  render::Context& context;
  JpegWriter& jpeg;
  Eigen::Vector2i draft_px;  ///< drafts fit into this
};

class FilmRun {
 public:
  using Stop = std::function<bool()>;

  /// Throws the exceptions of building a simulation.
  FilmRun(FilmDef def, std::shared_ptr<const producer::ModelLibrary> models, const Workshop& workshop);

  const FilmDef& def() const { return def_; }
  int frames() const { return scene_.frame_count(); }
  /// Uses another camera for the same film. The states are kept; `film` is the key of the new pictures.
  void look_from(const std::optional<ViewCamera>& camera, const std::string& film);

  bool has_state(int frame) const;
  bool has_draft(int frame) const { return workshop_.frames.has(def_.film, frame, Detail::draft); }
  /// The first frame without a draft; frames() + 1 if there is none.
  int first_missing();
  bool is_simulated() const { return !physics_->statistics.empty(); }

  /// Makes the next simulate() begin at the start of the film.
  void restart();
  /// Simulates one frame, or a part of the time before frame 1. Throws DivergedError.
  void simulate();
  /// The latest simulated frame, or 0 before the first.
  int simulated_to() const { return simulation_ ? simulation_->frame() : 0; }
  /// Finished share of the work before frame 1.
  double lead_in() const;
  // These return false, without a picture, if `stop` returned true meanwhile; several threads call it.
  /// Draws a draft of a frame whose state is available, into the store.
  bool draw_draft(int frame, const Stop& stop);
  /// Draws the current state before frame 1 as frame 0.
  bool draw_lead_in(const Stop& stop);
  /// Draws a frame whose state is available at full size.
  bool refine(int frame, Detail detail, const Stop& stop);
  /// Name of the visible object at a position of a frame, or empty. The position is a share of width and
  /// height, from the top left corner. The state must be available.
  std::string pick(int frame, double x, double y);
  /// A small picture for a sheet; the state must be available.
  render::Image small_picture(int frame) { return draft_picture().draw(previous(frame), state(frame)); }

  const Physics& physics() const { return *physics_; }
  const producer::Scene& scene() const { return scene_; }
  /// Time of the state reached before frame 1 [s].
  double lead_in_time() const;

 private:
  struct Refined {
    producer::Scene scene;
    std::optional<producer::Picture> picture;  // declared after the scene, to which it refers
  };

  producer::Picture& draft_picture();
  bool draw_draft(int frame, const producer::Snapshot& before, const producer::Snapshot& now,
                  const Stop& stop);
  void make_simulation();
  void add_figures(double sim_ms);
  void finish();
  const producer::Snapshot& state(int frame) const;
  const producer::Snapshot& previous(int frame) const {
    return frame > 1 && has_state(frame - 1) ? state(frame - 1) : state(frame);
  }

  FilmDef def_;
  std::shared_ptr<const producer::ModelLibrary> models_;
  Workshop workshop_;
  producer::Scene scene_;  // as used for drafts
  std::shared_ptr<Physics> physics_;
  std::optional<producer::Simulation> simulation_;
  std::optional<sim::Energy> energy_start_;
  std::shared_ptr<const producer::Snapshot> latest_[2];  // also used if the store has no room
  std::optional<producer::Picture> picture_;
  std::unique_ptr<Refined> refined_;
  render::Camera camera_;
  int advances_ = 0;
  int missing_hint_ = 1;
};

}  // namespace offstage::tune
