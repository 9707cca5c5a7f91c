#include "render/trace/air_field.h"

#include <algorithm>

#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

constexpr std::size_t kMostTraced = 4096;  // approximate number of particles at which light is traced
constexpr float kCells = 16;               // cells along the longest side of the particles' bounding box

}  // namespace

template <class Each>
void AirField::for_corners(const Vector3f& place, Each&& each) const {
  const Eigen::Array3f at = ((place - origin_) / cell_m_).array();
  const Eigen::Array3i first = at.floor().cast<int>().max(0).min(size_ - 2);
  const Eigen::Array3f far = (at - first.cast<float>()).max(0.0f).min(1.0f), near = 1 - far;
  for (int k = 0; k < 8; ++k) {
    const bool x = (k & 1) != 0, y = (k & 2) != 0, z = (k & 4) != 0;
    const float weight = (x ? far : near).x() * (y ? far : near).y() * (z ? far : near).z();
    const int corner = (first.x() + x) + size_.x() * ((first.y() + y) + size_.y() * (first.z() + z));
    each(static_cast<std::size_t>(corner), weight);
  }
}

AirField::AirField(const LightTracer& tracer, const SampleOffsets& offsets, std::span<const Ball> balls,
                   const AirRadiance& open) {
  if (balls.empty()) return;
  Eigen::AlignedBox3f box;
  for (const Ball& ball : balls) box.extend(ball.center);
  origin_ = box.min();
  cell_m_ = std::max(box.sizes().maxCoeff() / kCells, 1e-6f);
  size_ = (box.sizes() / cell_m_).array().ceil().cast<int>().max(1).min(static_cast<int>(kCells)) + 1;
  corners_.assign(static_cast<std::size_t>(size_.prod()), Sums::Zero());

  const float fraction = static_cast<float>(kMostTraced) / static_cast<float>(balls.size());
  std::vector<Ball> traced;
  std::ranges::copy_if(balls, std::back_inserter(traced),
                       [&](const Ball& ball) { return ball.number < fraction; });
  std::vector<Sums> found(traced.size());
  tbb::parallel_for(std::size_t{0}, traced.size(), [&](std::size_t k) {
    const AirLightAround around = tracer.trace_air(traced[k].center, traced[k].number, offsets, open);
    found[k] << 1, around.sky, around.light.constant, around.light.slope.reshaped(), 0, 0;
  });
  for (std::size_t k = 0; k < traced.size(); ++k) {
    total_ += found[k];
    for_corners(traced[k].center,
                [&](std::size_t corner, float weight) { corners_[corner] += weight * found[k]; });
  }
  if (total_[0] == 0) total_ << 1, 1, open.constant, open.slope.reshaped(), 0, 0;
}

AirLightAround AirField::at(const Vector3f& place) const {
  Sums sum = Sums::Zero();
  for_corners(place, [&](std::size_t corner, float weight) { sum += weight * corners_[corner]; });
  if (!(sum[0] > 1e-6f)) sum = total_;  // far from the traced particles
  sum /= sum[0];
  AirLightAround result;
  result.sky = sum[1];
  result.light.constant = sum.segment<3>(2).matrix();
  result.light.slope = sum.segment<9>(5).matrix().reshaped(3, 3);
  return result;
}

}  // namespace offstage::render
