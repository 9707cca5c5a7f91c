#include "render/trace/ray_particles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "render/trace/embree.h"

namespace offstage::render {
namespace {

constexpr int kMostOnRay = 128;      // particles on a segment; the farther ones are left out
constexpr float kFlake = 0.88f;      // radius of a disc with the area of a flake, see shaders/points.frag
constexpr float kDark = 1.0f / 256;  // transmittance below which nothing behind is visible

// Equal to coverage() in shaders/points_shape.glsl.
float coverage(float across, float softness) {
  const float x = std::clamp((across - 1 + softness) / softness, 0.0f, 1.0f);
  return 1 - x * x * (3 - 2 * x);
}

/// Returns the part of a vector that is perpendicular to a ray.
Vector3f across(const Vector3f& v, const Vector3f& direction) {
  return v - v.dot(direction) * direction;
}

/// Returns the opacity of a particle for a ray, as a fraction of the opacity in its middle.
float opacity_on_ray(const RayParticleSet& set, std::size_t i, const Vector3f& from,
                     const Vector3f& direction) {
  if (!set.lines) {
    const Vector4f& disc = set.places[i];
    const float shape = set.scattering == Scattering::flake ? kFlake : 1.0f;
    return coverage(across(disc.head<3>() - from, direction).norm() / (shape * disc.w()), set.softness);
  }
  // As in splatter.cpp, with the half axis from the middle to the tail.
  const Vector4f &head = set.places[2 * i], &tail = set.places[2 * i + 1];
  const float radius = head.w();
  const Vector3f axis = across(0.5f * (tail - head).head<3>(), direction),
                 from_middle = across(from - 0.5f * (head + tail).head<3>(), direction);
  const float half_length = axis.norm();
  const Vector3f unit = half_length > 0 ? Vector3f(axis / half_length) : Vector3f(Vector3f::Zero());
  const float along = from_middle.dot(unit), nearest = std::clamp(along, -half_length, half_length);
  const float to_tail = 0.5f + 0.5f * std::clamp(along / (half_length + radius), -1.0f, 1.0f);
  return coverage((from_middle - nearest * unit).norm() / radius, set.softness) * (1 - set.taper * to_tail);
}

/// Returns the normal of a particle's surface on a ray; zero for drops. That of sprites is interpolated from
/// the corners of their quads, as in shaders/points.vert, and is therefore shorter.
Vector3f normal_on_ray(const RayParticleSet& set, std::size_t i, const Vector3f& from,
                       const Vector3f& direction) {
  if (set.scattering == Scattering::flake) return {0, 0.5f, 0};
  if (set.lines) return Vector3f::Zero();
  const Vector4f& disc = set.places[i];
  const Vector3f normal = across(from - disc.head<3>(), direction) / disc.w() - 0.7f * direction;
  return set.scattering == Scattering::sprite ? Vector3f(normal / std::sqrt(2.49f)) : normal.normalized();
}

}  // namespace

float forward_lobe(Scattering scattering, float cosine) {
  const float forward = scattering == Scattering::drop ? 0.5f + 0.5f * cosine : std::max(cosine, 0.0f);
  const float forward2 = forward * forward, forward4 = forward2 * forward2;
  if (scattering == Scattering::drop) return forward4 * forward4;
  return scattering == Scattering::puff ? forward4 * forward2 : forward4;
}

void RayParticles::reset(std::function<std::vector<RayParticleSet>()> make) {
  make_ = std::move(make);
  sets_.clear();
  tree_.reset();
  tree_with_drops_.reset();
  built_ = MetParticles::none;
}

std::vector<RayParticleSet*> RayParticles::build(MetParticles groups) {
  std::vector<RayParticleSet*> unlit;
  if (groups <= built_) return unlit;
  const bool first = built_ == MetParticles::none;
  built_ = groups;
  if (first) sets_ = make_();
  std::size_t lines = 0;
  for (const RayParticleSet& set : sets_)
    if (set.lines) lines = std::max(lines, set.size());
  for (std::size_t i = first_of_line_.size(); i < lines; ++i)
    first_of_line_.push_back(2 * static_cast<uint32_t>(i));
  if (first) tree_ = tree_of(MetParticles::no_drops);
  bool drops = false;
  for (RayParticleSet& set : sets_) {
    const bool is_drops = set.scattering == Scattering::drop;
    drops = drops || is_drops;
    const bool is_new = is_drops ? groups == MetParticles::all : first;
    if (is_new && set.scattering != Scattering::none) unlit.push_back(&set);
  }
  if (drops && groups == MetParticles::all) tree_with_drops_ = tree_of(groups);
  return unlit;
}

RayTree RayParticles::tree_of(MetParticles groups) const {
  RayTree tree = embree::make_tree(RTC_BUILD_QUALITY_LOW);
  for (std::size_t k = 0; k < sets_.size(); ++k) {
    const RayParticleSet& set = sets_[k];
    const bool is_met = groups == MetParticles::all || set.scattering != Scattering::drop;
    if (!is_met || set.size() == 0) continue;
    RTCGeometry geometry =
        embree::make_geometry(set.lines ? RTC_GEOMETRY_TYPE_FLAT_LINEAR_CURVE : RTC_GEOMETRY_TYPE_DISC_POINT);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, set.places.data(), 0,
                               sizeof(Vector4f), set.places.size());
    if (set.lines)
      rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, first_of_line_.data(),
                                 0, sizeof(uint32_t), set.size());
    embree::attach(tree.get(), geometry, static_cast<unsigned>(k));
  }
  rtcCommitScene(tree.get());
  return tree;
}

ParticlesOnRay RayParticles::along(const Vector3f& from, const Vector3f& direction, float length,
                                   MetParticles groups, const ParticleAir& air) const {
  const float towards_sun = air.to_sun.dot(direction);
  const bool with_drops = groups == MetParticles::all && tree_with_drops_ != nullptr;
  RTCScene tree = with_drops ? tree_with_drops_.get() : tree_.get();
  ParticlesOnRay found;
  float near = 0;
  for (int k = 0; k < kMostOnRay && found.transmittance > kDark; ++k) {
    RTCRayHit ray;
    embree::set_ray(ray.ray, from, direction, length, ~0u);
    ray.ray.tnear = near;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree::intersect(tree, ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
    near = std::nextafter(ray.ray.tfar, std::numeric_limits<float>::infinity());
    const RayParticleSet& set = sets_[ray.hit.geomID];
    const std::size_t i = ray.hit.primID;
    const float opacity = std::min(set.colors[i].w(), 1.0f) * opacity_on_ray(set, i, from, direction);
    Vector3f radiance = set.colors[i].head<3>();
    if (set.scattering != Scattering::none)
      radiance = radiance.cwiseProduct(set.light[i].diffuse.at(normal_on_ray(set, i, from, direction)) +
                                       forward_lobe(set.scattering, towards_sun) * set.light[i].forward);
    found.radiance += found.transmittance * opacity * std::exp(-air.fog * ray.ray.tfar) * radiance;
    found.transmittance *= 1 - set.cover * opacity;
  }
  return found;
}

}  // namespace offstage::render
