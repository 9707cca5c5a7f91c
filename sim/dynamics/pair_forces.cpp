#include "sim/dynamics/pair_forces.h"

#include <cmath>
#include <numeric>
#include <optional>

#include <oneapi/tbb/parallel_for.h>

#include "sim/dynamics/flat.h"
#include "sim/dynamics/neighbor_grid.h"
#include "sim/linear/lane_vector.h"

namespace offstage::sim {
namespace {

/// Number of particles per task.
constexpr std::size_t kPairChunk = 32;
/// Below this squared distance, a force without a length scale does not increase any more [m^2].
constexpr Real kLeastSquare = 1e-30;

Real root_node(Real x) {
  return std::sqrt(x);
}
Lanes root_node(Lanes x) {
  return lane_sqrt(x);
}
Real greater(Real x, Real y) {
  return x > y ? x : y;
}
Lanes greater(Lanes x, Real y) {
  return lane_max(x, lanes(y));
}

/// The law U = c / sqrt(r^2 + s^2) between particles of weight 1. The force on the first particle is
/// factor(r^2) d, where d is the vector to it from the second.
struct InverseDistance {
  Real constant, softening2;

  template <class T>
  T square(T r2) const {
    return greater(r2 + softening2, kLeastSquare);
  }
  template <class T>
  T factor(T r2) const {
    const T s = square(r2);
    return constant / (s * root_node(s));
  }
  /// Returns the derivative of factor by r^2.
  Real slope(Real r2) const { return -1.5 * factor(r2) / square(r2); }
  Real energy(Real r2) const { return constant / root_node(square(r2)); }
};

/// The law U = 4 e (q^2 - q) with q = (sigma^2 / r^2)^3.
struct TwelveSix {
  Real epsilon, sigma2;

  template <class T>
  T square(T r2) const {
    return greater(r2, 1e-6 * sigma2);
  }
  template <class T>
  T attraction(T r2) const {
    const T ratio = sigma2 / square(r2);
    return ratio * ratio * ratio;
  }
  template <class T>
  T factor(T r2) const {
    const T q = attraction(r2);
    return 24 * epsilon / square(r2) * q * (2 * q - 1);
  }
  Real slope(Real r2) const {
    const Real q = attraction(r2), s = square(r2);
    return 24 * epsilon / (s * s) * q * (4 - 14 * q);
  }
  Real energy(Real r2) const {
    const Real q = attraction(r2);
    return 4 * epsilon * q * (q - 1);
  }
};

InverseDistance kernel(const MutualGravitation& f) {
  return {-f.constant, f.softening * f.softening};
}
InverseDistance kernel(const Coulomb& f) {
  return {f.constant, f.softening * f.softening};
}
TwelveSix kernel(const LennardJones& f) {
  return {f.epsilon, f.sigma * f.sigma};
}
Real weight(const MutualGravitation&, const PairMember& m) {
  return m.mass;
}
Real weight(const Coulomb&, const PairMember& m) {
  return m.charge;
}
Real weight(const LennardJones&, const PairMember&) {
  return 1;
}

/// The particles on which a force law acts, at one stage of the integration.
struct Cloud {
  template <class Law>
  Cloud(const Law& law, std::span<const PairMember> members, std::span<const Real> state)
      : cut_off(law.cut_off), member(members.size()), points(members.size()) {
    const auto place = [&](std::size_t i) { return vec3(state, 3 * members[i].place); };
    for (std::size_t i = 0; i < size(); ++i) points[i] = place(i).allFinite() ? Vec3(place(i)) : Vec3::Zero();
    std::iota(member.begin(), member.end(), 0u);
    if (cut_off > 0) sort_by_cells();
    // Elements that fill the last lanes have no weight. Particles at infinite or NaN positions have none
    // either, so they do not affect others.
    for (auto* v : {&x, &y, &z, &w}) v->resize((size() + 3) / 4 * 4, 0.0);
    for (std::size_t i = 0; i < size(); ++i) {
      const Vec3& p = points[i];
      x[i] = p.x(), y[i] = p.y(), z[i] = p.z();
      if (place(member[i]).allFinite())
        w[i] = weight(law, members[member[i]]) * strength(law.region, law.drop_rate, p);
    }
  }

  std::size_t size() const { return points.size(); }

  /// Calls f(j, d) for every other particle j that acts on i. d is the vector from j to i.
  template <class F>
  void for_each_near(std::size_t i, F&& f) const {
    const auto visit = [&](std::size_t j) {
      if (j != i) f(j, Vec3(points[i] - points[j]));
    };
    if (grid)
      grid->for_each_near(points[i], cut_off, visit);
    else
      for (std::size_t j = 0; j < size(); ++j) visit(j);
  }

  Real cut_off;
  std::vector<uint32_t> member;  // index of each point among the given members
  std::vector<Vec3> points;
  std::vector<Real> x, y, z, w;
  std::optional<NeighborGrid> grid;

 private:
  /// Sorts the particles by cells, so that neighbours are close in memory.
  void sort_by_cells() {
    grid.emplace().build(points, cut_off);
    for (std::size_t i = 0; i < size(); ++i) member[i] = grid->at(i);
    std::vector<Vec3> sorted(size());
    for (std::size_t i = 0; i < size(); ++i) sorted[i] = points[member[i]];
    points = std::move(sorted);
    grid->build(points, cut_off);
  }
};

/// Returns the force of all other particles on particle i [N].
template <class Kernel>
Vec3 force_by_all(const Kernel& kernel, const Cloud& c, std::size_t i) {
  LaneVector<Lanes> sum{};
  const Lanes x = lanes(c.x[i]), y = lanes(c.y[i]), z = lanes(c.z[i]), w = lanes(c.w[i]);
  for (std::size_t j = 0; j < c.x.size(); j += 4) {
    const auto four = [&](const std::vector<Real>& v) { return Lanes(_mm256_loadu_pd(&v[j])); };
    const LaneVector<Lanes> d{x - four(c.x), y - four(c.y), z - four(c.z)};
    // The particle itself is at distance 0 and adds a finite factor times zero.
    sum = sum + (w * four(c.w) * kernel.factor(dot(d, d))) * d;
  }
  const auto total = [](Lanes v) { return (v[0] + v[1]) + (v[2] + v[3]); };
  return {total(sum.x), total(sum.y), total(sum.z)};
}

template <class Kernel>
Vec3 force_by_near(const Kernel& kernel, const Cloud& c, std::size_t i) {
  Vec3 sum = Vec3::Zero();
  c.for_each_near(i, [&](std::size_t j, const Vec3& d) {
    sum += (c.w[i] * c.w[j] * kernel.factor(d.squaredNorm())) * d;
  });
  return sum;
}

template <class F>
void for_each_parallel(std::size_t size, F&& f) {
  tbb::parallel_for(std::size_t{0}, (size + kPairChunk - 1) / kPairChunk, [&](std::size_t chunk) {
    for (std::size_t i = chunk * kPairChunk; i < std::min(size, (chunk + 1) * kPairChunk); ++i) f(i);
  });
}

/// Calls f(law) if the force is one that acts between particles.
template <class F>
void with_law(const ForceDef& def, F&& f) {
  std::visit(
      [&]<class Effect>(const Effect& effect) {
        if constexpr (kIsPairLaw<Effect>) f(effect);
      },
      def.effect);
}

void add_block(const Mat3& block, std::size_t row, std::size_t column, int at_v, int at_x,
               SparseEntries& entries) {
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      entries.emplace_back(at_v + 3 * static_cast<int>(row) + i, at_x + 3 * static_cast<int>(column) + k,
                           block(i, k));
}

}  // namespace

void PairForces::accelerate(std::span<const Real> x, std::span<Real> dv) const {
  for (const Group& g : groups_) {
    with_law(*g.def, [&](const auto& law) {
      const Cloud cloud(law, g.members, x);
      const auto k = kernel(law);
      for_each_parallel(cloud.size(), [&](std::size_t i) {
        const Vec3 force = cloud.grid ? force_by_near(k, cloud, i) : force_by_all(k, cloud, i);
        const PairMember& m = g.members[cloud.member[i]];
        vec3(dv, 3 * m.place) += force / m.mass;
      });
    });
  }
}

void PairForces::jacobian(std::span<const Real> x, int at_x, int at_v, SparseEntries& entries) const {
  for (const Group& g : groups_)
    with_law(*g.def, [&](const auto& law) {
      const Cloud cloud(law, g.members, x);
      const auto k = kernel(law);
      const std::size_t size = cloud.size();
      const bool exact = size <= kExactJacobian;
      std::vector<Mat3> row(exact ? size : 0);
      for (std::size_t i = 0; i < size; ++i) {
        Mat3 own = Mat3::Zero();
        std::fill(row.begin(), row.end(), Mat3::Zero());
        // The derivative of factor d is factor 1 + 2 factor' d d^T.
        cloud.for_each_near(i, [&](std::size_t j, const Vec3& d) {
          const Real r2 = d.squaredNorm(), w = cloud.w[i] * cloud.w[j] / g.members[cloud.member[i]].mass;
          const Mat3 change = w * (k.factor(r2) * Mat3::Identity() + 2 * k.slope(r2) * d * d.transpose());
          own += change;
          if (exact) row[j] = -change;
        });
        const auto place = [&](std::size_t j) { return g.members[cloud.member[j]].place; };
        add_block(own, place(i), place(i), at_v, at_x, entries);
        for (std::size_t j = 0; j < row.size(); ++j)
          if (j != i) add_block(row[j], place(i), place(j), at_v, at_x, entries);
      }
    });
}

Real PairForces::potential_energy(Real t, std::span<const Real> x) const {
  Real total = 0;
  for (const Group& g : groups_) {
    if (!g.def->is_on(t)) continue;
    with_law(*g.def, [&](const auto& law) {
      const Cloud cloud(law, g.members, x);
      const auto k = kernel(law);
      const Real edge = law.cut_off > 0 ? k.energy(law.cut_off * law.cut_off) : 0;
      std::vector<Real> energy(cloud.size());
      for_each_parallel(cloud.size(), [&](std::size_t i) {
        cloud.for_each_near(i, [&](std::size_t j, const Vec3& d) {
          energy[i] += cloud.w[i] * cloud.w[j] * (k.energy(d.squaredNorm()) - edge) / 2;
        });
      });
      for (Real e : energy) total += e;
    });
  }
  return total;
}

}  // namespace offstage::sim
