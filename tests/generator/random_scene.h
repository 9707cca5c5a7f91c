#pragma once
/// Random scenes, and invariants that must hold in each of them. A scene is a function of its seed alone, so
/// a seed is enough to reproduce a failure: see random_scenes_test.cpp.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/world.h"

namespace offstage::sim {

/// A world before it is made: bodies and meshes by their places in the lists.
struct RandomScene {
  struct Body {
    BodyDef def;
    std::optional<std::size_t> mesh;  ///< in place of the shape
    Real reach = 0;                   ///< of a ball around its centre that it is in [m]
  };
  struct Joint {
    JointDef def;
    std::size_t a = 0;
    std::optional<std::size_t> b;  ///< none: the world
  };
  struct Spring {
    SpringDef def;
    std::size_t a = 0;
    std::optional<std::size_t> b;  ///< none: the point of the world that `def` has
  };

  uint64_t seed = 0;
  WorldDef world;
  Real duration = 1;       ///< [s]
  Real room = 0;           ///< half of its width [m]; 0: there are no walls, and nothing acts from outside
  bool is_driven = false;  ///< something does work: a kinematic body or a motor
  std::vector<TriangleMesh> meshes;
  std::vector<Body> bodies;  ///< the walls first
  std::vector<Joint> joints;
  std::vector<Spring> springs;
  std::vector<Particle> particles;
  ParticleSystemDef particle_system;
  std::optional<ClothDef> cloth;
};

/// What a scene may be made of: bodies and walls alone, or also joints, springs, drives, particles and cloth.
enum class Parts { bodies, all };

RandomScene random_scene(uint64_t seed, Parts parts);

/// Everything that is in it, one object a line, as a scene file would name it.
std::string text(const RandomScene& scene);

World make_world(const RandomScene& scene);

/// What a run showed.
struct Findings {
  bool finite = true;
  std::vector<std::string> lost;  ///< bodies that left the world, or the room
  Real energy_gain = 0;           ///< greatest rise above the least so far [J]
  Real energy_scale = 1;          ///< scale of the scene's energies [J]
  Real gained_at = 0;             ///< when it was greatest [s]
  Real penetration = 0;           ///< penetration of bodies when it exceeded the allowed one most [m]
  Real allowed_penetration = 0;   ///< allowed penetration at that time, see Overlap in random_scene.cpp [m]
  Real momentum_error = 0, angular_momentum_error = 0;  ///< of the greatest sizes of their parts
  uint64_t work = 0, allowed_work = 0;                  ///< greatest of a step, counted
  uint64_t rough = 0;                                   ///< fall-backs of contact solvers
  StateHash hash;
};

/// Runs a scene to its end.
Findings simulate(const RandomScene& scene);

/// What must not be, in words; empty if all is well.
std::string faults(const RandomScene& scene, const Findings& findings);

}  // namespace offstage::sim
