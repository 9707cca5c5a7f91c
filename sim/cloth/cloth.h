#pragma once
/// Cloth as the world takes it and shows it (physics F6-F8): points with mass, springs of three kinds between
/// them, and triangles over them that collide, feel the air and are drawn. effects/cloth.h makes definitions
/// from fabrics, grids and meshes.

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "sim/core/handle.h"
#include "sim/core/types.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

struct BodyTag;
using BodyHandle = Handle<BodyTag>;
struct ClothTag {};
using ClothHandle = Handle<ClothTag>;

enum class SpringKind : uint8_t {
  stretch,  ///< to direct neighbours; these tear
  shear,    ///< across the diagonals of cells
  bend,     ///< to second neighbours, or across an edge
};

/// F = -(k (|d| - L) + c (d'.d)/|d|) d/|d| on vertex a, d from b to a.
struct ClothSpring {
  uint32_t a = 0, b = 0;  ///< vertices
  Real rest_length = 1;   ///< L [m], > 0
  Real stiffness = 100;   ///< k [N/m], > 0
  Real damping = 0;       ///< c [N s/m], >= 0
  SpringKind kind = SpringKind::stretch;
};

/// Holds a vertex at a point of the world or of a body, which feels its pull.
struct ClothPin {
  uint32_t vertex = 0;
  BodyHandle body;                                     ///< null: the world
  Vec3 position = Vec3::Zero();                        ///< in the body's frame, or of the world [m]
  Real until = std::numeric_limits<Real>::infinity();  ///< lets go at this time [s]
};

/// Draws two vertices together, and then holds them.
struct ClothSeam {
  uint32_t a = 0, b = 0;
};

/// How the springs are stepped.
enum class ClothIntegrator : uint8_t {
  /// Backward Euler, linearised once and solved by one symmetric Gauss-Seidel sweep: true to every static
  /// load, quick, and stable, because springs too stiff for it have their stiffness clamped
  /// (ClothReport::clamped).
  relaxed,
  /// Backward Euler, linearised once (Baraff and Witkin, "Large Steps in Cloth Simulation", 1998) and solved.
  implicit,
  symplectic,  ///< explicit: unstable beyond largest_stable_step()
  rk4,         ///< explicit, of fourth order between collisions: likewise
};

/// What the air does to each triangle. With the relative air velocity u, the unit normal n and the area A:
/// F = rho A / 2 |u| ((C_D - C_L) u + C_L (u.n) n): C_D of air that comes square, C_D - C_L of what comes
/// along.
struct ClothAir {
  Real drag = 1;       ///< C_D, >= 0
  Real lift = 0.9;     ///< C_L, >= 0, <= C_D, or it would drive itself
  Real density = 1.2;  ///< rho [kg/m^3], >= 0; 0: no air
};

struct ClothDef {
  std::string name;
  std::vector<Vec3> vertices;       ///< at the start [m]
  std::vector<Vec3> rest_vertices;  ///< of the unstrained cloth [m]; empty: as `vertices`
  std::vector<Triangle> triangles;
  std::vector<ClothSpring> springs;
  std::vector<Real> masses;  ///< of the vertices [kg], > 0
  std::vector<ClothPin> pins;
  std::vector<ClothSeam> seams;
  Real seam_time = 1;  ///< in which seams close [s], > 0

  Vec3 velocity = Vec3::Zero();  ///< at the start [m/s]

  bool collides = true;        ///< with bodies and particles
  bool self_collision = true;  ///< with itself and with other cloths that have this
  Real thickness = 0.005;      ///< distance kept from bodies, and between two layers [m], > 0
  Real friction = 0.5;         ///< on bodies: with theirs by the geometric mean, as between bodies
  Real self_friction = 0.3;    ///< of cloth on cloth

  Real max_stretch = 0;  ///< greatest length of stretch springs over their rest length, > 1; 0: no limit (F7)
  Real max_shear = 0;    ///< the same of shear springs
  /// Length over rest length at which a stretch spring tears, > 1; 0: never. max_stretch counts as 1.2 of
  /// it, if it is less.
  Real tear = 0;

  ClothAir air;
  /// Over-pressure inside of a closed cloth [Pa]: at its rest volume V0; at the volume V it is
  /// pressure V0 / V, as that of a gas that keeps its temperature. 0: none.
  Real pressure = 0;
  /// Of an open cloth that catches the air, as a parachute: which share of the stagnation pressure rho
  /// (u.m)^2 / 2 of the air that comes in at its mouth builds up inside, on the side its normals point away
  /// from. 0: none.
  Real ram_pressure = 0;

  ClothIntegrator integrator = ClothIntegrator::relaxed;
  Real substep = 1.0 / 960;  ///< longest step of its own [s], > 0; never longer than the world's
};

/// What is wrong with a definition: the field, the place, what is allowed. Empty: nothing.
std::string problem(const ClothDef& def);

/// The longest step at which an explicit integrator is stable, by the springs alone, and the spring that sets
/// it: around it stiffness is greatest against mass.
struct StableStep {
  Real step = std::numeric_limits<Real>::infinity();  ///< [s]
  uint32_t spring = 0;                                ///< of the definition
};
/// Only of `symplectic` and `rk4`; for the others infinite.
StableStep largest_stable_step(const ClothDef& def);

/// How a cloth is doing. Counts are of all sub-steps of the last step, others of its end.
struct ClothReport {
  uint64_t contacts = 0;       ///< of vertices and bodies' corners with bodies, at the end
  uint64_t self_contacts = 0;  ///< at the end
  uint64_t particle_hits = 0;  ///< of all sub-steps
  Real max_strain = 0;         ///< of stretch springs, greatest (|d| - L) / L
  Real mean_strain = 0;        ///< of stretch springs, mean |(|d| - L) / L|
  Real penetration = 0;        ///< deepest, of a vertex behind a body's surface, 0 while it is outside [m]
  uint64_t limited = 0;        ///< moves shortened, to keep max_stretch and max_shear or for the next reason
  uint64_t held_back = 0;    ///< times that a move was shortened because cloth would have gone through cloth
  uint64_t crossings = 0;    ///< pairs that had to be let go: the guarantee against crossing is lost there
  uint64_t clamped = 0;      ///< springs too stiff for the `relaxed` integrator at its step, at the end
  uint64_t torn = 0;         ///< springs
  uint64_t unconverged = 0;  ///< solves of the implicit integrator that ended at their bound
  bool finite = true;        ///< false: it stopped being finite, and was stopped where it last was
};

/// What is to be seen of a cloth; valid until the next step.
struct ClothView {
  std::span<const Vec3> points;      ///< [m]
  std::span<const Vec3> velocities;  ///< [m/s]
  std::span<const Triangle> triangles;
  /// Of each point the vertex of the definition that it comes from: points are added where cloth tears.
  std::span<const uint32_t> sources;
  uint32_t version = 0;  ///< grows when triangles or the number of points change
};

}  // namespace offstage::sim
