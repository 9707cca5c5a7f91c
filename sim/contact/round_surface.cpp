#include "sim/contact/round_surface.h"

#include "sim/collision/collision_mesh.h"

namespace offstage::sim {
namespace {

bool is_revolved_shape(const Shape& shape) {
  return std::holds_alternative<Cylinder>(shape) || std::holds_alternative<Cone>(shape) ||
         std::holds_alternative<Frustum>(shape);
}

}  // namespace

bool RoundSurface::is_revolved() const {
  return is_revolved_shape(*shape);
}

Real RoundSurface::round_radius() const {
  if (const auto* sphere = std::get_if<Sphere>(shape)) return sphere->radius;
  if (const auto* capsule = std::get_if<Capsule>(shape)) return capsule->radius;
  return 0;
}

RoundSurface round_surface(const Body& body, uint32_t piece) {
  // A torus has the rim of this disc as its core. The size of the disc is not used.
  static const Shape disc = Cylinder{1, 0};
  const Vec3 centre = body.is_awake() ? body.rigid.centre : Vec3(Vec3::Zero());
  RoundSurface surface{.shape = &body.def.shape, .place = {}, .centre = centre};
  const RoundSolid* round = body.solid.mesh ? body.solid.mesh->round_surface(piece) : nullptr;
  if (!round) return surface;
  surface.place = round->pose;
  surface.centre = round->pose.point_to_body(centre);
  if (const auto* torus = std::get_if<RoundedDisc>(&round->shape)) {
    surface.shape = &disc;
    surface.around = torus->around;
  } else {
    surface.shape = &std::get<Shape>(round->shape);
  }
  return surface;
}

bool has_revolved_part(const Body& body) {
  return is_revolved_shape(body.def.shape) || (body.solid.mesh && !body.solid.mesh->hulls().empty());
}

}  // namespace offstage::sim
