#include "sim/cloth/cloth.h"

#include <algorithm>
#include <cmath>

#include "sim/cloth/cloth_state.h"

namespace offstage::sim {
namespace {

bool is_positive(Real v) {
  return v > 0 && std::isfinite(v);
}
bool is_not_negative(Real v) {
  return v >= 0 && std::isfinite(v);
}

std::string element(const char* field, std::size_t i) {
  return std::string(field) + "[" + std::to_string(i) + "] ";
}

std::string vertex_problem(const ClothDef& def) {
  if (def.vertices.empty()) return "it has no vertices";
  if (!def.rest_vertices.empty() && def.rest_vertices.size() != def.vertices.size())
    return "rest_vertices must be empty or have one position for each vertex";
  if (def.masses.size() != def.vertices.size()) return "masses must have one value for each vertex";
  for (std::size_t i = 0; i < def.vertices.size(); ++i) {
    if (!def.vertices[i].allFinite()) return element("vertices", i) + "must be finite";
    if (!is_positive(def.masses[i])) return element("masses", i) + "must be a finite number > 0";
  }
  for (std::size_t i = 0; i < def.rest_vertices.size(); ++i)
    if (!def.rest_vertices[i].allFinite()) return element("rest_vertices", i) + "must be finite";
  return {};
}

std::string spring_problem(const ClothDef& def) {
  const std::size_t count = def.vertices.size();
  for (std::size_t i = 0; i < def.springs.size(); ++i) {
    const ClothSpring& s = def.springs[i];
    if (s.a >= count || s.b >= count || s.a == s.b)
      return element("springs", i) + "must join two different vertices that exist";
    if (!is_positive(s.rest_length)) return element("springs", i) + "rest_length must be a finite number > 0";
    if (!is_positive(s.stiffness)) return element("springs", i) + "stiffness must be a finite number > 0";
    if (!is_not_negative(s.damping)) return element("springs", i) + "damping must be a finite number >= 0";
    if (!is_not_negative(s.counterpart_rest))
      return element("springs", i) + "counterpart_rest must be a finite number >= 0";
    if (s.counterpart_rest > 0 && std::max(s.counterpart[0], s.counterpart[1]) >= count)
      return element("springs", i) + "counterpart must join two vertices that exist";
  }
  return {};
}

std::string index_problem(const ClothDef& def) {
  const std::size_t count = def.vertices.size();
  for (std::size_t i = 0; i < def.triangles.size(); ++i) {
    const Triangle& t = def.triangles[i];
    if (std::max({t[0], t[1], t[2]}) >= count)
      return element("triangles", i) + "refers to a vertex that does not exist";
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return element("triangles", i) + "has a vertex twice";
  }
  for (std::size_t i = 0; i < def.pins.size(); ++i) {
    if (def.pins[i].vertex >= count) return element("pins", i) + "refers to a vertex that does not exist";
    if (!def.pins[i].position.allFinite()) return element("pins", i) + "position must be finite";
    if (std::isnan(def.pins[i].until)) return element("pins", i) + "until must be a number";
  }
  for (std::size_t i = 0; i < def.seams.size(); ++i)
    if (def.seams[i].a >= count || def.seams[i].b >= count || def.seams[i].a == def.seams[i].b)
      return element("seams", i) + "must join two different vertices that exist";
  return {};
}

std::string limit_problem(const char* field, Real value) {
  return value == 0 || (value > 1 && std::isfinite(value)) ? "" : std::string(field) + " must be 0 or > 1";
}

std::string number_problem(const ClothDef& def) {
  if (!def.velocity.allFinite()) return "velocity must be finite";
  const std::pair<const char*, Real> positive[] = {
      {"thickness", def.thickness}, {"substep", def.substep}, {"seam_time", def.seam_time}};
  for (const auto& [field, value] : positive)
    if (!is_positive(value)) return std::string(field) + " must be a finite number > 0";
  const std::pair<const char*, Real> not_negative[] = {{"friction", def.friction},
                                                       {"self_friction", def.self_friction},
                                                       {"air.drag", def.air.drag},
                                                       {"air.lift", def.air.lift},
                                                       {"air.density", def.air.density},
                                                       {"ram_pressure", def.ram_pressure},
                                                       {"bend", def.bend},
                                                       {"bend_damping", def.bend_damping},
                                                       {"min_bend_radius", def.min_bend_radius},
                                                       {"inflate_time", def.inflate_time},
                                                       {"gas_density", def.gas_density.value_or(0)}};
  for (const auto& [field, value] : not_negative)
    if (!is_not_negative(value)) return std::string(field) + " must be a finite number >= 0";
  if (!(def.rest_curvature >= 0 && def.rest_curvature <= 1)) return "rest_curvature must be 0 to 1";
  if (def.air.lift > def.air.drag) return "air.lift must not be above air.drag";
  if (!std::isfinite(def.pressure)) return "pressure must be finite";
  for (const std::string& wrong :
       {limit_problem("max_stretch", def.max_stretch), limit_problem("max_shear", def.max_shear),
        limit_problem("tear", def.tear)})
    if (!wrong.empty()) return wrong;
  return {};
}

}  // namespace

std::string problem(const ClothDef& def) {
  for (const auto& check : {vertex_problem, spring_problem, index_problem, number_problem})
    if (std::string wrong = check(def); !wrong.empty()) return wrong;
  if (def.gas_density && !(def.pressure > 0)) return "gas_density needs a pressure > 0";
  if (def.pressure != 0) {
    const auto& rest = def.rest_vertices.empty() ? def.vertices : def.rest_vertices;
    if (!MeshTopology({rest, def.triangles}).defects().closed()) return "pressure needs a closed surface";
    if (!(enclosed_volume(rest, def.triangles) > 0))
      return "pressure needs triangles whose normals point outwards";
  }
  return {};
}

Real enclosed_volume(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  if (triangles.empty()) return 0;
  // Coordinates relative to one of the points keep their precision far from the origin.
  const Vec3& o = points[triangles[0][0]];
  Real six_fold = 0;
  for (const Triangle& t : triangles)
    six_fold += (points[t[0]] - o).dot((points[t[1]] - o).cross(points[t[2]] - o));
  return six_fold / 6;
}

Real elastic_energy(const Cloth& cloth) {
  Real energy = 0;
  for (const ClothSpring& s : cloth.springs) {
    const Real stretch = s.elongation((cloth.points[s.a] - cloth.points[s.b]).norm(), cloth.points);
    energy += s.stiffness * stretch * stretch / 2;
  }
  std::vector<Vec4> points;
  for (const Vec3& p : cloth.points) points.push_back(padded(p));
  return energy + cloth.bending.energy(points);
}

Cloth::Cloth(ClothHandle cloth, const ClothDef& definition)
    : handle(cloth),
      def(definition),
      points(def.vertices),
      velocities(points.size(), def.velocity),
      rest(def.rest_vertices.empty() ? def.vertices : def.rest_vertices),
      before(points),
      masses(def.masses),
      triangles(def.triangles),
      springs(def.springs),
      pins(def.pins) {
  for (uint32_t i = 0; i < points.size(); ++i) sources.push_back(i);
  for (const ClothSeam& s : def.seams) seam_lengths.push_back((points[s.a] - points[s.b]).norm());
  if (def.pressure != 0) rest_volume = enclosed_volume(rest, triangles);
  assign_bending();
}

void Cloth::assign_bending() {
  bending.assign(rest, triangles, masses, def.bend, def.bend_damping, def.rest_curvature,
                 def.min_bend_radius > 0);
}

}  // namespace offstage::sim
