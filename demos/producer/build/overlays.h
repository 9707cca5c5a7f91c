#pragma once
/// Converts the state of a simulation to the lines of overlays: bounding trees, closest points, contacts,
/// velocities and islands of bodies, and the strain of cloths. Overlays do not change the simulation.

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "producer/build/snapshot.h"
#include "producer/scene/scene.h"
#include "sim/collision/collision_shape.h"
#include "sim/world.h"

namespace offstage::producer {

class Overlays {
 public:
  using BodiesByName = std::map<std::string, sim::BodyHandle>;
  using ClothsByName = std::map<std::string, sim::ClothHandle>;

  /// Prepares the overlays of a scene, which must outlive this object.
  Overlays(const Scene& scene, const sim::World& world, const BodiesByName& bodies,
           const ClothsByName& cloths);

  /// Returns the lines of each overlay for the current state of the world, in scene order. The overlay of the
  /// parts of a body has no lines, because the parts are drawn as surfaces.
  std::vector<LineSet> lines(const sim::World& world) const;
  /// Records the current state for overlays that draw past states. Must be called as time advances.
  void record(const sim::World& world);

 private:
  /// The bounding volumes of a tree down to the deepest level that is drawn, as edges in the body's frame.
  struct TreeLines {
    struct Volume {
      int level;
      bool leaf;
      std::vector<std::pair<Vec3, Vec3>> edges;
    };
    const TreeOverlay* overlay;
    sim::BodyHandle body;
    std::vector<Volume> volumes;
  };
  /// A body in the form that the narrow phase needs.
  struct Collider {
    sim::BodyHandle body;
    sim::Shape shape;
    std::optional<sim::CollisionShape> collision;
  };
  /// Two bodies. At most one is a plane, which is then `b`.
  struct ColliderPair {
    const Collider *a, *b;
  };
  struct ClosestLines {
    const ClosestOverlay* overlay;
    ColliderPair pair;
  };
  struct ContactLines {
    const ContactsOverlay* overlay;
    sim::BodyHandle a, b;             // only the simulation's contacts of these bodies; null: all
    std::vector<ColliderPair> pairs;  // pairs without contacts in the simulation
  };
  struct VelocityLines {
    const VelocitiesOverlay* overlay;
    std::vector<sim::BodyHandle> bodies;
  };
  struct IslandLines {
    struct Boxed {
      sim::BodyHandle body;
      std::vector<std::pair<Vec3, Vec3>> edges;  // in the body's frame
    };
    const IslandsOverlay* overlay;
    std::vector<Boxed> bodies;
  };
  struct JointLines {
    const JointsOverlay* overlay;
    std::vector<sim::JointHandle> joints;
  };
  struct ClothLines {
    const ClothOverlay* overlay;
    std::vector<sim::ClothHandle> cloths;
  };
  struct TrailLines {
    struct Trail {
      sim::BodyHandle body;
      Eigen::Vector4f color;
      std::deque<std::pair<Real, Vec3>> places;  // time and centre of mass, oldest first
    };
    const TrailsOverlay* overlay;
    std::vector<Trail> trails;
  };
  struct NoLines {};
  using Source = std::variant<NoLines, TreeLines, ClosestLines, ContactLines, VelocityLines, IslandLines,
                              JointLines, ClothLines, TrailLines>;

  struct Builder;

  static LineSet draw(const NoLines&, const sim::World&) { return {}; }
  static LineSet draw(const TreeLines& tree, const sim::World& world);
  static LineSet draw(const ClosestLines& closest, const sim::World& world);
  static LineSet draw(const ContactLines& contacts, const sim::World& world);
  static LineSet draw(const VelocityLines& velocities, const sim::World& world);
  static LineSet draw(const IslandLines& islands, const sim::World& world);
  static LineSet draw(const JointLines& joints, const sim::World& world);
  static LineSet draw(const ClothLines& cloths, const sim::World& world);
  static LineSet draw(const TrailLines& trails, const sim::World& world);

  std::map<std::string, Collider> colliders_;  // by the name of the body
  std::vector<Source> sources_;
};

}  // namespace offstage::producer
