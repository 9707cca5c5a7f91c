#include "producer/build/body_shapes.h"

#include <algorithm>
#include <type_traits>

#include "producer/base/to_float.h"

namespace offstage::producer {
namespace {

template <class S>
inline constexpr bool kIsHollow =
    std::is_same_v<S, sim::Torus> || std::is_same_v<S, sim::Tube> || std::is_same_v<S, sim::OpenBox>;

sim::MassProperties unit_mass(const PartShape& shape) {
  return std::visit(
      []<class S>(const S& s) {
        if constexpr (kIsHollow<S>)
          return sim::mass_properties(s);
        else
          return sim::mass_properties(sim::Shape(s));
      },
      shape);
}

sim::SolidMesh solid_of(const PartShape& shape) {
  return std::visit(
      []<class S>(const S& s) {
        if constexpr (kIsHollow<S>)
          return sim::solid_mesh(s);
        else
          return sim::solid_mesh(sim::Shape(s));
      },
      shape);
}

sim::Pose pose_of(const CompoundPart& part) {
  return {part.position, part.orientation};
}

std::vector<sim::MassPart> mass_parts(const Body& body) {
  return std::visit(
      [&]<class S>(const S& s) -> std::vector<sim::MassPart> {
        std::vector<sim::MassPart> parts;
        if constexpr (std::is_same_v<S, Compound>) {
          for (const CompoundPart& part : s.parts)
            parts.push_back({unit_mass(part.shape), pose_of(part), part.density.value_or(body.density)});
        } else if constexpr (!std::is_same_v<S, MeshFile> && !std::is_same_v<S, sim::Plane>) {
          parts.push_back({unit_mass(PartShape(s)), {}, body.density});
        }
        return parts;
      },
      body.shape);
}

std::optional<ShapeProblem> problem_of(const sim::Torus& t) {
  if (t.tube_radius < t.radius) return {};
  return ShapeProblem{"/tube_radius", "must be less than the \"radius\" of the torus"};
}
std::optional<ShapeProblem> problem_of(const sim::Tube& t) {
  if (t.thickness < t.radius) return {};
  return ShapeProblem{"/thickness",
                      "must be less than the \"radius\" of the tube; use a cylinder for a solid one"};
}
std::optional<ShapeProblem> problem_of(const sim::OpenBox& b) {
  if (2 * b.thickness < std::min(b.size.x(), b.size.z()) && b.thickness < b.size.y()) return {};
  return ShapeProblem{"/thickness",
                      "must be less than half of \"size\" along x and z, and less than \"size\" along y"};
}
template <class S>
std::optional<ShapeProblem> problem_of(const S&) {
  return {};
}
std::optional<ShapeProblem> problem_of(const Compound& compound) {
  if (compound.parts.empty()) return ShapeProblem{"/parts", "is empty; a compound needs at least one part"};
  for (std::size_t i = 0; i < compound.parts.size(); ++i) {
    auto wrong = std::visit([](const auto& s) { return problem_of(s); }, compound.parts[i].shape);
    if (wrong) return ShapeProblem{"/parts/" + std::to_string(i) + "/shape" + wrong->key, wrong->what};
  }
  return {};
}

}  // namespace

std::vector<float> shape_key(const sim::Sphere& s) {
  return {0, to_float(s.radius)};
}
std::vector<float> shape_key(const sim::Box& s) {
  return {1, to_float(s.size.x()), to_float(s.size.y()), to_float(s.size.z())};
}
std::vector<float> shape_key(const sim::Capsule& s) {
  return {2, to_float(s.radius), to_float(s.height)};
}
std::vector<float> shape_key(const sim::Cylinder& s) {
  return {3, to_float(s.radius), to_float(s.height)};
}
std::vector<float> shape_key(const sim::Cone& s) {
  return {4, to_float(s.radius), to_float(s.height)};
}
std::vector<float> shape_key(const sim::Plane&) {
  return {5};
}
std::vector<float> shape_key(const sim::Frustum& s) {
  return {7, to_float(s.radius), to_float(s.top_radius), to_float(s.height)};
}
std::vector<float> shape_key(const sim::Ellipsoid& s) {
  return {8, to_float(s.radii.x()), to_float(s.radii.y()), to_float(s.radii.z())};
}
std::vector<float> shape_key(const sim::Torus& s) {
  return {9, to_float(s.radius), to_float(s.tube_radius)};
}
std::vector<float> shape_key(const sim::Tube& s) {
  return {10, to_float(s.radius), to_float(s.height), to_float(s.thickness)};
}
std::vector<float> shape_key(const sim::OpenBox& s) {
  return {11, to_float(s.size.x()), to_float(s.size.y()), to_float(s.size.z()), to_float(s.thickness)};
}

Vec3 half_extent(const sim::Sphere& s) {
  return Vec3::Constant(s.radius);
}
Vec3 half_extent(const sim::Box& s) {
  return s.size / 2;
}
Vec3 half_extent(const sim::Capsule& s) {
  return {s.radius, s.height / 2 + s.radius, s.radius};
}
Vec3 half_extent(const sim::Cylinder& s) {
  return {s.radius, s.height / 2 + s.radius, s.radius};
}
Vec3 half_extent(const sim::Cone& s) {
  return {s.radius, s.height / 2 + s.radius, s.radius};
}
Vec3 half_extent(const sim::Plane&) {
  return Vec3::Zero();
}
Vec3 half_extent(const sim::Frustum& s) {
  const Real radius = std::max(s.radius, s.top_radius);
  return {radius, s.height / 2, radius};
}
Vec3 half_extent(const sim::Ellipsoid& s) {
  return s.radii;
}
Vec3 half_extent(const sim::Torus& s) {
  return {s.radius + s.tube_radius, s.tube_radius, s.radius + s.tube_radius};
}
Vec3 half_extent(const sim::Tube& s) {
  return {s.radius, s.height / 2, s.radius};
}
Vec3 half_extent(const sim::OpenBox& s) {
  return s.size / 2;
}
Vec3 half_extent(const Compound& s) {
  Vec3 half = Vec3::Zero();
  for (const CompoundPart& part : s.parts) {
    const Vec3 own = std::visit([](const auto& shape) { return half_extent(shape); }, part.shape);
    half = half.cwiseMax(part.position.cwiseAbs() + part.orientation.toRotationMatrix().cwiseAbs() * own);
  }
  return half;
}

std::vector<sim::SolidMesh> solids_of(const Shape& shape) {
  return std::visit(
      []<class S>(const S& s) -> std::vector<sim::SolidMesh> {
        std::vector<sim::SolidMesh> solids;
        if constexpr (kIsHollow<S>) solids.push_back(sim::solid_mesh(s));
        if constexpr (std::is_same_v<S, Compound>)
          for (const CompoundPart& part : s.parts)
            solids.push_back(placed(solid_of(part.shape), pose_of(part)));
        return solids;
      },
      shape);
}

std::vector<float> solids_key(const Shape& shape) {
  return std::visit(
      []<class S>(const S& s) -> std::vector<float> {
        std::vector<float> key;
        if constexpr (kIsHollow<S>) key = shape_key(s);
        if constexpr (std::is_same_v<S, Compound>)
          for (const CompoundPart& part : s.parts) {
            const std::vector<float> own = std::visit([](const auto& p) { return shape_key(p); }, part.shape);
            key.insert(key.end(), own.begin(), own.end());
            for (const Real v : part.position) key.push_back(to_float(v));
            for (const Real v : part.orientation.coeffs()) key.push_back(to_float(v));
          }
        return key;
      },
      shape);
}

std::optional<sim::Mat3> inertia_of(const Body& body) {
  if (!body.inertia) return {};
  const Vec3 &moments = *body.inertia, &products = body.inertia_products;
  sim::Mat3 inertia;
  inertia << moments.x(), products.x(), products.z(),  //
      products.x(), moments.y(), products.y(),         //
      products.z(), products.y(), moments.z();
  return inertia;
}

std::optional<sim::BodyMass> mass_by_shape(const Body& body) {
  const std::vector<sim::MassPart> parts = mass_parts(body);
  if (parts.empty()) return std::nullopt;
  sim::BodyMass sum = sim::sum_of(parts);
  if (body.mass > 0) {
    sum.inertia *= body.mass / sum.mass;
    sum.mass = body.mass;
  }
  if (body.centre) sum.centre = *body.centre;
  if (const auto own = inertia_of(body)) sum.inertia = *own;
  return sum;
}

std::optional<ShapeProblem> problem(const Shape& shape) {
  return std::visit([](const auto& s) { return problem_of(s); }, shape);
}

bool is_mesh(const Body& body) {
  return std::visit(
      [](const auto& shape) { return !std::is_constructible_v<sim::Shape, std::decay_t<decltype(shape)>>; },
      body.shape);
}

}  // namespace offstage::producer
