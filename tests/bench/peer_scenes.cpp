/// Runs the scenes of the benchmarks against other engines. peer_common.hpp defines the scenes and the
/// measurements, and is the same for every engine. Usage: peer_scenes SCENE N STEPS DT [VARIANT], with the
/// variants exact, fast, auto (the default), each with +sleep, and +2 for two threads.

#include <cinttypes>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include <oneapi/tbb/global_control.h>

#include "peer_common.hpp"
#include "sim/world.h"

namespace {

using namespace offstage::sim;

Vec3 vec(const peer::Vec3& v) {
  return {v.x, v.y, v.z};
}
peer::Vec3 vec(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

TriangleMesh hull_mesh() {
  TriangleMesh mesh;
  for (const peer::Vec3& v : peer::hull_vertices()) mesh.vertices.push_back(vec(v));
  for (const auto& f : peer::hull_faces())
    mesh.triangles.push_back(
        {static_cast<uint32_t>(f[0]), static_cast<uint32_t>(f[1]), static_cast<uint32_t>(f[2])});
  return mesh;
}

WorldDef world_def(const peer::Scene& scene, double dt, const std::string& variant) {
  WorldDef def{.gravity = vec(scene.gravity), .max_step = dt, .sleep = false};
  def.bounds = {Vec3::Constant(-1e5), Vec3::Constant(1e5)};  // a chain of 10 000 links is 5 km long
  if (variant.find("exact") != std::string::npos) def.solver = SolverKind::exact;
  if (variant.find("fast") != std::string::npos) def.solver = SolverKind::fast;
  if (variant.find("+sleep") != std::string::npos) def.sleep = true;
  return def;
}

class Engine {
 public:
  Engine(const peer::Scene& scene, double dt, const std::string& variant)
      : threads_(tbb::global_control::max_allowed_parallelism,
                 variant.find("+2") != std::string::npos ? 2 : 1),
        world_(world_def(scene, dt, variant)),
        dt_(dt) {
    MeshHandle hull;
    for (const peer::Body& b : scene.bodies) {
      BodyDef def{.motion = b.mass > 0 ? MotionType::dynamic : MotionType::static_body,
                  .pose = {vec(b.pos), Quat(b.rot.w, b.rot.x, b.rot.y, b.rot.z)},
                  .velocity = vec(b.vel),
                  .mass = b.mass,
                  .restitution = scene.restitution,
                  .friction = scene.mu,
                  .collides = scene.contacts};
      if (b.shape == peer::Shape::Box) {
        def.shape = Box{2 * vec(b.half)};
      } else if (b.shape == peer::Shape::Sphere) {
        def.shape = Sphere{b.radius};
      } else {
        if (!hull) hull = world_.add_mesh(hull_mesh());
        def.shape = MeshShape{hull};
      }
      handles_.push_back(world_.add_body(def));
    }
    for (const auto& joint : scene.joints) {
      JointDef def;
      def.a = handles_[static_cast<std::size_t>(joint.b)];
      if (joint.a >= 0) def.b = handles_[static_cast<std::size_t>(joint.a)];
      def.anchor = vec(joint.anchor);
      world_.add_joint(def);
    }
  }
  /// Prints the statistics of the solvers to standard error.
  ~Engine() {
    const SolverFigures& s = figures_.solvers;
    std::fprintf(stderr,
                 "exact: %" PRIu64 " solves, %" PRIu64 " iterations, %" PRIu64 " factorizations, %" PRIu64
                 " fall-backs; fast: %" PRIu64 " solves; impacts: %" PRIu64 ", %" PRIu64
                 " fall-backs, %" PRIu64 " trace-backs, %" PRIu64 " cut short\n",
                 s.exact.solves, s.exact.iterations, s.exact.factorizations, s.exact.fallbacks, s.fast.solves,
                 s.impacts.solves, s.impacts.fallbacks, figures_.impacts.tracebacks,
                 figures_.impacts.toi_limit_reached);
  }
  void step() { figures_.add(world_.step(dt_)); }
  void sync() {}
  peer::State state(int i) const {
    const BodyState s = world_.body(handles_[static_cast<std::size_t>(i)]);
    const Quat& q = s.pose.orientation;
    return {vec(s.centre), {q.w(), q.x(), q.y(), q.z()}, vec(s.velocity), vec(s.angular_velocity)};
  }

 private:
  tbb::global_control threads_;
  World world_;
  double dt_;
  std::vector<BodyHandle> handles_;
  StepFigures figures_;
};

}  // namespace

int main(int argc, char** argv) {
  try {
    return peer::run<Engine>("offstage", peer::parse_args(argc, argv));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "peer_scenes: %s\n", e.what());
    return 1;
  }
}
