#include "producer/format/spring_net.h"

#include <algorithm>
#include <cmath>

namespace offstage::producer {

std::size_t SpringNet::object(const End& end) {
  if (end.object.empty() || std::isinf(end.mass)) return 0;
  const auto [it, is_new] = numbers_.try_emplace(end.object, inverse_masses_.size());
  if (is_new) inverse_masses_.push_back(1 / end.mass);
  return it->second;
}

void SpringNet::add(std::size_t spring, const End& a, const End& b, Real stiffness) {
  const Vec3 d = a.place - b.place;
  if (d.isZero()) return;  // without a length it has no direction yet
  links_.push_back({spring, object(a), object(b), d.normalized(), stiffness});
}

// Power iteration with the matrix W K W, where W is the root of the inverse mass. The quotient of Rayleigh is
// a lower bound after any number of iterations.
SpringNet::Fastest SpringNet::stiffest() const {
  constexpr int kIterations = 40;
  const std::size_t n = inverse_masses_.size();
  std::vector<Vec3> x(n), next(n);
  std::vector<Real> root(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto number =
        static_cast<Real>(i);  // the start is any vector that is not perpendicular to a motion
    x[i] = {std::sin(1 + 2 * number), std::sin(2 + 3 * number), std::sin(3 + 5 * number)};
    root[i] = std::sqrt(inverse_masses_[i]);
  }
  Fastest result;
  for (int k = 0; k < kIterations && !links_.empty(); ++k) {
    std::fill(next.begin(), next.end(), Vec3::Zero());
    Real greatest = 0, sum = 0, length2 = 0;
    for (const Vec3& v : x) length2 += v.squaredNorm();
    for (const Link& link : links_) {
      const Real speed = link.along.dot(root[link.a] * x[link.a] - root[link.b] * x[link.b]);
      const Real force = link.stiffness * speed;
      next[link.a] += root[link.a] * force * link.along;
      next[link.b] -= root[link.b] * force * link.along;
      sum += force * speed;
      if (force * speed > greatest) {
        greatest = force * speed;
        result.spring = link.spring;
      }
    }
    result.rate = length2 > 0 ? sum / length2 : 0;
    Real norm2 = 0;
    for (const Vec3& v : next) norm2 += v.squaredNorm();
    if (!(norm2 > 0) || !std::isfinite(norm2)) break;
    for (std::size_t i = 0; i < n; ++i) x[i] = next[i] / std::sqrt(norm2);
  }
  return result;
}

}  // namespace offstage::producer
