#include "producer/scene/particles.h"

#include <numbers>
#include <type_traits>

#include "producer/scene/scene.h"
#include "sim/core/rotation.h"

namespace offstage::producer {
namespace {

/// Returns the defaults of a style. Self-luminous particles cast no shadow.
render::PointsDef usual_look(LookStyle style) {
  using render::PointStyle;
  switch (style) {
    case LookStyle::sprite:
      return {.style = PointStyle::sprite, .stretch_s = 0};
    case LookStyle::streak:
      return {.style = PointStyle::streak};
    case LookStyle::sphere:
    case LookStyle::mesh:  // drawn as instances
      return {.style = PointStyle::sphere};
    case LookStyle::smoke:
      return {.style = PointStyle::smoke, .stretch_s = 0};
    case LookStyle::fire:
      return {.style = PointStyle::fire,
              .additive = true,
              .lit = false,
              .casts_shadow = false,
              .stretch_s = 0.1f};
    case LookStyle::flake:
      return {.style = PointStyle::flake, .casts_shadow = false, .stretch_s = 0.004f};
    case LookStyle::drop:
      return {.style = PointStyle::streak, .casts_shadow = false, .stretch_s = 1.0f / 60};
    case LookStyle::spark:
      return {.style = PointStyle::streak,
              .additive = true,
              .lit = false,
              .casts_shadow = false,
              .stretch_s = 1.0f / 40,
              .taper = 1};
  }
  return {};
}

}  // namespace

render::PointsDef points_def(const ParticleLook& look) {
  render::PointsDef def = usual_look(look.style);
  const auto take = [](const std::optional<Real>& given, float& value) {
    if (given) value = static_cast<float>(*given);
  };
  def.additive = look.additive.value_or(def.additive);
  def.lit = look.lit.value_or(def.lit);
  def.casts_shadow = look.casts_shadow.value_or(def.casts_shadow);
  take(look.softness, def.softness);
  take(look.stretch, def.stretch_s);
  take(look.taper, def.taper);
  take(look.metallic, def.metallic);
  take(look.roughness, def.roughness);
  if (look.sheet) def.sheet = *look.sheet;
  return def;
}

bool ParticleLook::turns() const {
  return (style == LookStyle::sprite && !texture.empty()) || style == LookStyle::flake ||
         style == LookStyle::mesh;
}

TrailSource::TrailSource() {
  NewParticles::operator=(effects::TrailDef().particles);
}

EventSource::EventSource() {
  NewParticles::operator=(effects::SubEmitterDef().particles);
}

Quat PlaneSurface::orientation() const {
  const Quat turned(Eigen::AngleAxisd(turn_deg * std::numbers::pi / 180, Vec3::UnitY()));
  return sim::rotation_between(Vec3::UnitY(), direction) * turned;
}

namespace {

PlaneSurface rectangle(const Vec3& centre, const Vec3& size, Face face) {
  const int axis = face <= Face::bottom ? 1 : face <= Face::right ? 0 : 2;
  const bool positive = face == Face::top || face == Face::right || face == Face::front;
  PlaneSurface plane;
  plane.direction = (positive ? 1 : -1) * Vec3::Unit(axis);
  plane.position = centre + size[axis] / 2 * plane.direction;
  // The smallest rotation of +Y to the normal turns x into y (left, right), or z into y (front, back).
  plane.size = {axis == 0 ? size.y() : size.x(), axis == 2 ? size.y() : size.z()};
  return plane;
}

std::optional<EmitterSurface> cap(Real radius, Real height, Face face) {
  if (face > Face::bottom || !(radius > 0)) return std::nullopt;
  const Vec3 up = face == Face::top ? Vec3(Vec3::UnitY()) : Vec3(-Vec3::UnitY());
  return DiscSurface{height / 2 * up, up, radius};
}

}  // namespace

std::optional<EmitterSurface> face_of(const FaceSurface& surface, const Body* body) {
  if (!body) return rectangle(surface.position, surface.size, surface.face);
  const Face face = surface.face;
  return std::visit(
      [&]<class S>(const S& s) -> std::optional<EmitterSurface> {
        if constexpr (std::is_same_v<S, sim::Box>) return rectangle(Vec3::Zero(), s.size, face);
        if constexpr (std::is_same_v<S, sim::Cylinder>) return cap(s.radius, s.height, face);
        if constexpr (std::is_same_v<S, sim::Cone>)
          return cap(face == Face::bottom ? s.radius : 0, s.height, face);
        if constexpr (std::is_same_v<S, sim::Frustum>)
          return cap(face == Face::bottom ? s.radius : s.top_radius, s.height, face);
        return std::nullopt;
      },
      body->shape);
}

Vec3& position_of(EmitterSurface& surface) {
  return std::visit([](auto& s) -> Vec3& { return s.position; }, surface);
}
const Vec3& position_of(const EmitterSurface& surface) {
  return std::visit([](const auto& s) -> const Vec3& { return s.position; }, surface);
}

}  // namespace offstage::producer
