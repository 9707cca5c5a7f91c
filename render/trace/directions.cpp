#include "render/trace/directions.h"

namespace offstage::render {

using Eigen::Vector3f;

Vector3f visible_facet(const Vector3f& n, const Vector3f& view, float a, const SquarePoint<float>& uv) {
  Three<float> across, along;
  make_basis(from_eigen(n), across, along);
  const Vector3f x = to_eigen(across), y = to_eigen(along);
  const Vector3f local(view.dot(x), view.dot(y), std::max(view.dot(n), 1e-3f));
  const Vector3f stretched = Vector3f(a * local.x(), a * local.y(), local.z()).normalized();
  const float angle = 2 * std::numbers::pi_v<float> * uv.x;
  const float z = (1 - uv.y) * (1 + stretched.z()) - stretched.z();
  const float r = std::sqrt(std::clamp(1 - z * z, 0.0f, 1.0f));
  const Vector3f h = Vector3f(r * std::cos(angle), r * std::sin(angle), z) + stretched;
  const Vector3f facet = Vector3f(a * h.x(), a * h.y(), std::max(h.z(), 1e-6f)).normalized();
  return facet.x() * x + facet.y() * y + facet.z() * n;
}

}  // namespace offstage::render
