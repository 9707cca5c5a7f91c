#pragma once
/// Public definitions and views of cloth (physics F6-F8). A cloth consists of points with mass, three kinds
/// of springs between them, and triangles that collide, feel the air and are drawn. effects/cloth.h makes
/// definitions from fabrics, grids and meshes.

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
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
  stretch,  ///< between direct neighbours; these springs tear
  shear,    ///< along the diagonals of cells
  bend,     ///< between second neighbours, or between the vertices opposite an edge
  cord,     ///< segment of a cord; it neither tears nor has a stretch limit
};

/// A damped spring: F = -(k e + c (d'.d)/|d|) d/|d| on vertex a, with the vector d from b to a and the
/// elongation e = |d| - L.
///
/// The two diagonals of a woven cell can be each other's counterpart. Then e is half the difference of their
/// elongations. The cell resists shear, but a load along its threads causes no force in the diagonals. So
/// `stretch` alone determines the length of the cloth under a load.
struct ClothSpring {
  uint32_t a = 0, b = 0;  ///< vertices
  Real rest_length = 1;   ///< L [m], > 0
  Real stiffness = 100;   ///< k [N/m], > 0
  Real damping = 0;       ///< c [N s/m], >= 0
  SpringKind kind = SpringKind::stretch;
  std::array<uint32_t, 2> counterpart = {};  ///< vertices of the other diagonal (its counterpart)
  Real counterpart_rest = 0;                 ///< rest length of the counterpart [m]; 0: there is none

  /// Returns the elongation e of the spring. `length`: its current length; `at`: the positions of the points.
  template <class Points>
  Real elongation(Real length, const Points& at, std::size_t first = 0) const {
    if (counterpart_rest == 0) return length - rest_length;
    const Real other = (at[counterpart[0] - first] - at[counterpart[1] - first]).norm();
    return (length - rest_length - other + counterpart_rest) / 2;
  }
};

/// Holds a vertex at a point of the world or of a body. The cloth exerts a force on the body.
struct ClothPin {
  uint32_t vertex = 0;
  BodyHandle body;  ///< null: the world
  /// Position in the body's frame or, without a body, in the world [m].
  Vec3 position = Vec3::Zero();
  Real until = std::numeric_limits<Real>::infinity();  ///< the pin is released at this time [s]
};

/// Pulls two vertices together within ClothDef::seam_time, and then holds them together.
struct ClothSeam {
  uint32_t a = 0, b = 0;
};

/// Integration of the springs.
enum class ClothIntegrator : uint8_t {
  /// Backward Euler, linearised once and solved by one symmetric Gauss-Seidel sweep. It is exact under static
  /// loads and fast. Each sub-step is divided into as many steps of the springs as the stiffest of them needs
  /// for stability, but none is shorter than kShortestSpringStep.
  relaxed,
  /// Backward Euler, linearised once (Baraff and Witkin, "Large Steps in Cloth Simulation", 1998). The linear
  /// system is solved by conjugate gradients.
  implicit,
  symplectic,  ///< explicit: unstable beyond largest_stable_step()
  rk4,         ///< explicit, of fourth order between collisions: unstable beyond largest_stable_step()
};

/// Aerodynamic force on each triangle. With the relative air velocity u, the unit normal n and the area A: F
/// = rho A / 2 |u| ((C_D - C_L) u + C_L (u.n) n). C_D acts on air across the triangle, C_D - C_L on air along
/// it. The default C_D - C_L is 0.02. It is the friction of both sides of a plate in a turbulent boundary
/// layer, 2 * 0.074 Re^(-1/5) or 0.01 at 1 m and 10 m/s, doubled for rough cloth; the fabrics of
/// effects/fabric.h use it too.
struct ClothAir {
  Real drag = 1;       ///< C_D, >= 0
  Real lift = 0.98;    ///< C_L, >= 0, <= C_D, because a larger lift would add energy
  Real density = 1.2;  ///< rho [kg/m^3], >= 0; 0: no air
};

struct ClothDef {
  std::string name;
  std::vector<Vec3> vertices;       ///< positions at the start [m]
  std::vector<Vec3> rest_vertices;  ///< positions in the unstrained cloth [m]; empty: as `vertices`
  std::vector<Triangle> triangles;
  std::vector<ClothSpring> springs;
  /// Flexural rigidity B of the cloth [N m], >= 0: moment per unit of width at a curvature of 1/m
  /// (bending.h).
  Real bend = 0;
  /// Damping time tau of bending [s], >= 0: the moment per unit of width is B (kappa + tau d kappa/dt).
  Real bend_damping = 0;
  /// Fraction of the curvature of the unstrained cloth that is free of stress, 0 to 1.
  Real rest_curvature = 1;
  /// Smallest radius to which the cloth bends [m], >= 0; 0: no limit. The curvature in excess of the
  /// curvature at rest stays at most 1 / min_bend_radius (bend_limit.h). This holds for any model of bending,
  /// even without rigidity. If the cells of the mesh are larger than this radius, the limit has no effect,
  /// because the mesh itself cannot bend further.
  Real min_bend_radius = 0;
  std::vector<Real> masses;  ///< mass of each vertex [kg], > 0
  std::vector<ClothPin> pins;
  std::vector<ClothSeam> seams;
  Real seam_time = 1;  ///< time in which seams close [s], > 0

  Vec3 velocity = Vec3::Zero();  ///< velocity at the start, or when the cloth appears [m/s]
  /// Times between which the cloth exists [s]. It appears in its initial shape at the start of the first
  /// sub-step at or after appear_at, and is removed at the start of the first sub-step at or after remove_at.
  Real appear_at = 0, remove_at = kInfinity;

  bool collides = true;  ///< whether the cloth collides with bodies and particles
  /// Whether the cloth collides with itself, and with other cloths that have this flag.
  bool self_collision = true;
  Real thickness = 0.005;  ///< distance between cloth and bodies, and between two layers of cloth [m], > 0
  /// Coefficient of friction on bodies: the geometric mean with the body's coefficient is used, as between
  /// bodies.
  Real friction = 0.5;
  Real self_friction = 0.3;  ///< coefficient of friction of cloth on cloth

  Real max_stretch =
      0;  ///< greatest length of a stretch spring divided by its rest length, > 1; 0: no limit (F7)
  Real max_shear = 0;  ///< greatest length of a shear spring divided by its rest length; 0: no limit
  /// Length divided by rest length at which a stretch spring tears, > 1; 0: never. If there is a max_stretch,
  /// it counts as at least 1.2 * tear, so that springs can tear.
  Real tear = 0;

  ClothAir air;
  /// Overpressure inside a closed cloth at its rest volume V0 [Pa]; 0: none. At another volume V the
  /// overpressure is `pressure` times V0 / V: Boyle's law, applied to the overpressure alone.
  Real pressure = 0;
  /// Duration of the inflation at a constant rate [s], >= 0; 0: the gas is inside from the start.
  Real inflate_time = 0;
  /// Density of the gas inside [kg/m^3], >= 0; empty: air.density. Requires `pressure` > 0. The weight of the
  /// gas minus the weight of the displaced air acts on the cloth: the overpressure changes with the height at
  /// the rate (air.density - gas_density) g. The inertia of the gas and of the surrounding air is neglected.
  std::optional<Real> gas_density;
  /// For an open cloth such as a parachute: pressure inside, as a fraction of the stagnation pressure rho
  /// (u.m)^2 / 2 of the air that enters at the mouth. It acts on the side opposite to the normals. 0: none.
  Real ram_pressure = 0;

  ClothIntegrator integrator = ClothIntegrator::relaxed;
  Real substep =
      1.0 / 960;  ///< longest sub-step of the cloth [s], > 0; it is also limited by the world's sub-step
  /// Whether springs take a single step in each sub-step, with the integrator `relaxed`. The stiffness of
  /// springs that are too stiff for it is clamped (ClothReport::clamped).
  bool soften = false;
};

/// The shortest step of the springs of a `relaxed` cloth [s]. The stiffness of springs that are too stiff for
/// it is clamped.
inline constexpr Real kShortestSpringStep = 1e-5;

/// Returns a description of the first error of a definition: field, place and allowed values. The text is
/// empty if the definition is valid.
std::string problem(const ClothDef& def);

/// Stability limit of an explicit integrator, considering only springs and bending. It also returns the
/// spring that determines the limit, which has the greatest ratio of stiffness to mass.
struct StableStep {
  Real step = std::numeric_limits<Real>::infinity();  ///< [s]
  uint32_t spring = 0;                                ///< index of the spring in the definition
  bool bending = false;                               ///< whether bending limits the step, and not a spring
};
/// Largest stable step of a definition. It is infinite unless the integrator is `symplectic` or `rk4`.
StableStep largest_stable_step(const ClothDef& def);

/// The first stretch spring of a cloth that tore.
struct ClothTear {
  Real time = 0;              ///< end of the sub-step in which it tore [s]
  Vec3 place = Vec3::Zero();  ///< [m]
  Real stretch = 0;           ///< length of the spring divided by its rest length
  bool by_pressure = false;   ///< whether the cloth is closed and under pressure
  bool touches_body = false;  ///< whether the cloth touched a body in that sub-step
  BodyHandle body{};          ///< the one of these bodies that was nearest to the tear
};

/// The gas inside of a closed cloth.
struct ClothGasState {
  Real volume = 0;  ///< volume inside [m^3]; holes of tears are closed by a fan of triangles
  /// Overpressure [Pa]. If the gas has a weight, the overpressure at the height of the first vertex.
  Real pressure = 0;
};

/// Statistics of a cloth. Counts are sums over the sub-steps of the last step, unless stated otherwise; other
/// values are from its end.
struct ClothReport {
  uint64_t contacts = 0;       ///< contacts with bodies at the end: of vertices, and of bodies' corners
  uint64_t self_contacts = 0;  ///< contacts of cloth with cloth at the end
  uint64_t particle_hits = 0;  ///< collisions with particles in all sub-steps
  Real max_strain = 0;         ///< greatest strain of the stretch springs, (|d| - L) / L
  Real mean_strain = 0;        ///< mean of the absolute strain of the stretch springs
  Real penetration = 0;        ///< greatest depth of a vertex inside a body [m]; 0: none is inside
  uint64_t limited = 0;        ///< moves shortened to keep max_stretch and max_shear, or because of held_back
  uint64_t bend_limited = 0;   ///< cloth sub-steps in which the limit min_bend_radius acted
  Real max_bend = 0;           ///< greatest curvature times min_bend_radius at the end; 0 without a limit
  uint64_t held_back = 0;      ///< moves shortened because cloth would have passed through cloth
  uint64_t crossings =
      0;                 ///< pairs whose crossing could not be prevented; cloth may have passed through cloth
  uint64_t clamped = 0;  ///< springs whose stiffness the `relaxed` integrator clamped, at the end
  Real least_stiffness = 1;   ///< smallest ratio of clamped to defined stiffness of all springs
  uint32_t spring_steps = 1;  ///< number of steps of the springs in each sub-step of a `relaxed` cloth
  uint64_t torn = 0;          ///< number of torn springs
  uint64_t unconverged = 0;   ///< solves of springs or bending that reached the limit of iterations
  std::optional<ClothTear> first_tear;  ///< the first tear since the start; empty: the cloth never tore
  bool finite = true;  ///< false: the cloth became non-finite and stays at its last finite state
};

/// Read-only view of a cloth; valid until the next step.
struct ClothView {
  std::span<const Vec3> points;      ///< [m]
  std::span<const Vec3> velocities;  ///< [m/s]
  std::span<const Real> masses;      ///< [kg]
  std::span<const Triangle> triangles;
  /// For each point, the vertex of the definition that it comes from. Points are added where cloth tears.
  std::span<const uint32_t> sources;
  /// The springs that are not broken. Springs of the kind `cord` never break; their number and order are the
  /// same as in the definition.
  std::span<const ClothSpring> springs;
  uint32_t version = 0;  ///< increases whenever the triangles or the number of points change
};

}  // namespace offstage::sim
