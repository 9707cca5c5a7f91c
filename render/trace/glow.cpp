#include "render/trace/glow.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/trace/directions.h"

namespace offstage::render {
namespace {

constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;

float luminance(const Vector3f& light) {
  return Vector3f(0.2126f, 0.7152f, 0.0722f).dot(light);
}

}  // namespace

void Glow::add(unsigned object, const RayMesh& mesh, const RayMaterial& material,
               const Eigen::Affine3f& world_from_mesh, const Vector3f& center, float radius, bool is_ball) {
  const float scale2 = std::pow(std::abs(world_from_mesh.linear().determinant()), 2.0f / 3);
  const float power = luminance(material.mean_emission()) * scale2 * mesh.area();
  if (!(power > 0) || !std::isfinite(power)) return;
  sources_.push_back({object, &mesh, &material, world_from_mesh, center, radius, is_ball, power});
}

void Glow::limit() {
  if (sources_.size() <= kMost) return;
  // Not stable_sort: the buffer of libstdc++ 12 is not aligned as types of Eigen with AVX need it.
  std::ranges::sort(sources_, [](const Source& a, const Source& b) {
    return a.power != b.power ? a.power > b.power : a.object < b.object;
  });
  sources_.resize(kMost);
}

// The estimate is in proportion to the power divided by the square of the distance. It is 0 if the whole
// source is below the horizon of the surface.
float Glow::estimate(const Source& source, const Vector3f& place, const Vector3f& normal) {
  const Vector3f offset = source.center - place;
  if (offset.dot(normal) < -source.radius) return 0;
  return source.power / std::max(offset.squaredNorm(), source.radius * source.radius);
}

float Glow::Source::area_per_chance(unsigned triangle) const {
  const std::array<Vector3f, 3> p = mesh->corners(triangle, world_from_mesh);
  return 0.5f * (p[1] - p[0]).cross(p[2] - p[0]).norm() / mesh->chance_of(triangle);
}

float Glow::Source::cap(const Vector3f& place) const {
  const float sine2 = radius * radius / (center - place).squaredNorm();
  return sine2 < 1 ? sine2 / (1 + std::sqrt(1 - sine2)) : 0;
}

// Samples a direction in the cone that contains the ball.
GlowSample Glow::Source::sample_ball(const Vector3f& place, const SquarePoint<float>& uv) const {
  const Vector3f offset = center - place;
  const float wide = cap(place), distance = offset.norm();
  if (wide <= 0) return {};
  const float cosine = 1 - wide * uv.x, sine = std::sqrt(std::max(1 - cosine * cosine, 0.0f));
  const float turn = kTwoPi * uv.y;
  Three<float> a, b;
  make_basis(from_eigen(offset / distance), a, b);
  GlowSample result;
  result.towards =
      (cosine * offset / distance + sine * (std::cos(turn) * to_eigen(a) + std::sin(turn) * to_eigen(b)))
          .normalized();
  const float half2 = radius * radius - distance * distance * (1 - cosine * cosine);
  result.distance = distance * cosine - std::sqrt(std::max(half2, 0.0f));
  result.radiance = material->mean_emission();
  result.density = 1 / (kTwoPi * wide);
  return result;
}

GlowSample Glow::Source::sample_area(const Vector3f& place, float choice,
                                     const SquarePoint<float>& uv) const {
  const unsigned triangle = mesh->triangle_at(choice);
  const std::array<Vector3f, 3> p = mesh->corners(triangle, world_from_mesh);
  const float root = std::sqrt(uv.x);
  // Barycentric coordinates, uniformly distributed over the triangle.
  const Vector2f b(root * (1 - uv.y), root * uv.y);
  const Vector3f offset = p[0] + b.x() * (p[1] - p[0]) + b.y() * (p[2] - p[0]) - place;
  const Vector3f normal = (p[1] - p[0]).cross(p[2] - p[0]);
  GlowSample result;
  result.distance = offset.norm();
  if (!(result.distance > 0) || !(normal.norm() > 0)) return {};
  result.towards = offset / result.distance;
  const float cosine = std::abs(result.towards.dot(normal.normalized()));
  if (cosine < 1e-4f) return {};
  result.radiance = material->emission_at(mesh->uvs_at(triangle, b));
  result.density = offset.squaredNorm() / (cosine * area_per_chance(triangle));
  return result;
}

GlowSample Glow::sample(const Vector3f& place, const Vector3f& normal, float random,
                        const SquarePoint<float>& uv) const {
  const Source* kept = nullptr;
  WeightedChoice choice(random);
  for (const Source& source : sources_) {
    const float weight = estimate(source, place, normal);
    if (weight > 0 && choice.take(weight)) kept = &source;
  }
  if (kept == nullptr) return {};
  GlowSample result =
      kept->is_ball ? kept->sample_ball(place, uv) : kept->sample_area(place, choice.rest(), uv);
  result.density *= choice.weight() / choice.sum();
  return result;
}

float Glow::density(const Vector3f& place, const Vector3f& normal, const Hit& hit) const {
  float sum = 0, weight = 0;
  const Source* met = nullptr;
  for (const Source& source : sources_) {
    const float estimated = estimate(source, place, normal);
    sum += estimated;
    if (source.object != hit.object) continue;
    met = &source;
    weight = estimated;
  }
  if (met == nullptr || !(weight > 0)) return 0;
  if (met->is_ball) {
    const float wide = met->cap(place);
    return wide > 0 ? weight / (sum * kTwoPi * wide) : 0;
  }
  const Vector3f offset = hit.position - place;
  const float cosine = std::max(std::abs(offset.normalized().dot(hit.face)), 1e-4f);
  return weight / sum * offset.squaredNorm() / (cosine * met->area_per_chance(hit.triangle));
}

}  // namespace offstage::render
