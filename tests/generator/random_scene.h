#pragma once
/// Random scenes, and invariants that must hold in each of them. A scene depends only on its seed, so the
/// seed is sufficient to reproduce a failure; see random_scenes_test.cpp.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/world.h"

namespace offstage::sim {

/// The definition of a world. Joints and springs refer to bodies, and bodies to meshes, by their index in the
/// lists.
struct RandomScene {
  struct Body {
    BodyDef def;
    std::optional<std::size_t> mesh;  ///< used instead of the shape
    Real reach = 0;  ///< radius of a ball around the body's centre that contains the body [m]
  };
  struct Joint {
    JointDef def;
    std::size_t a = 0;
    std::optional<std::size_t> b;  ///< second body; none: connected to the world
  };
  struct Spring {
    SpringDef def;
    std::size_t a = 0;
    /// Body at the second end; none: the end is the point of the world in `def`.
    std::optional<std::size_t> b;
  };

  uint64_t seed = 0;
  WorldDef world;
  Real duration = 1;       ///< [s]
  Real room = 0;           ///< half of the room's width [m]; 0: no walls, and no external forces
  bool is_driven = false;  ///< a kinematic body or a motor does work
  std::vector<TriangleMesh> meshes;
  std::vector<Body> bodies;  ///< the walls come first
  std::vector<Joint> joints;
  std::vector<Spring> springs;
  std::vector<Particle> particles;
  ParticleSystemDef particle_system;
  std::optional<ClothDef> cloth;
};

/// The objects that a scene may contain: only bodies and walls, or also joints, springs, drives, particles
/// and cloth.
enum class Parts { bodies, all };

RandomScene random_scene(uint64_t seed, Parts parts);

/// Returns a description of the scene, one object per line, in the terms of the scene format.
std::string text(const RandomScene& scene);

World make_world(const RandomScene& scene);

/// The measured results of a run.
struct Findings {
  bool finite = true;
  std::vector<std::string> lost;  ///< bodies that left the world or the room
  Real energy_gain = 0;           ///< greatest increase of the energy over its earlier minimum [J]
  Real energy_scale = 1;          ///< scale of the scene's energies [J]
  Real gained_at = 0;             ///< time of the greatest increase [s]
  Real penetration = 0;           ///< penetration at the time of its greatest excess over the allowed one [m]
  Real allowed_penetration = 0;   ///< allowed penetration at that time, see Overlap in random_scene.cpp [m]
  Real momentum_error = 0, angular_momentum_error = 0;  ///< relative to the greatest sum of the magnitudes of
                                                        ///< their parts
  uint64_t work = 0, allowed_work = 0;                  ///< counted work of the most expensive step
  uint64_t rough = 0;                                   ///< fall-backs of contact solvers
  StateHash hash;
};

/// Runs a scene to its end.
Findings simulate(const RandomScene& scene);

/// Returns a description of the violated invariants; empty if there are none.
std::string faults(const RandomScene& scene, const Findings& findings);

}  // namespace offstage::sim
