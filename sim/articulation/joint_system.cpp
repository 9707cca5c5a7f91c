#include "sim/articulation/joint_system.h"

#include <algorithm>

namespace offstage::sim {
namespace {

/// Links with more joints than this are hubs: they get rows of their own in the matrix.
constexpr uint32_t kFewJoints = 3;
/// Fraction of the diagonal that is added if the matrix is not plain, and its factor for each further
/// attempt. At the stages of an integrator, loops are not closed exactly, and dependent constraints
/// contradict each other by about the square of the gap. The added fraction must be larger than this error,
/// or the impulses of these constraints would grow against each other.
constexpr Real kRegularization = 1e-6, kMore = 100;
constexpr int kAttempts = 3, kRefinements = 8;
/// The refinement ends when the residual is below kExact times the requested change. A step is at most
/// kLongest times as long as the step of the preconditioner.
constexpr Real kExact = 1e-12, kLongest = 2;

}  // namespace

JointSystem::JointSystem(uint32_t links, std::vector<Topology> joints) : joints_(std::move(joints)) {
  std::vector<uint32_t> degree(links, 0);
  for (const Topology& j : joints_)
    for (uint32_t link : {j.a, j.b})
      if (link != kDriven) ++degree[link];
  const auto grounded = static_cast<uint32_t>(std::count_if(
      joints_.begin(), joints_.end(), [](const Topology& j) { return j.a == kDriven || j.b == kDriven; }));
  // All driven bodies together count as one node.
  has_loops_ = joints_.size() > links - (grounded == 0 ? 1u : 0u);
  hub_row_.assign(links, kDriven);
  for (uint32_t link = 0; link < links; ++link)
    if (degree[link] > kFewJoints) {
      hub_row_[link] = static_cast<uint32_t>(joints_.size() + hubs_.size());
      hubs_.push_back(link);
    }
  is_small_ = hubs_.empty() &&
              std::all_of(joints_.begin(), joints_.end(), [](const Topology& j) { return j.rows <= 3; });
  find_couplings();
}

void JointSystem::find_couplings() {
  const auto joint_count = static_cast<uint32_t>(joints_.size());
  std::vector<std::vector<uint32_t>> at_link(hub_row_.size());
  for (uint32_t j = 0; j < joint_count; ++j)
    for (uint32_t link : {joints_[j].a, joints_[j].b})
      if (link != kDriven) at_link[link].push_back(j);
  for (uint32_t link = 0; link < at_link.size(); ++link) {
    const auto& at = at_link[link];
    if (is_hub(link)) {
      for (uint32_t j : at) couplings_.push_back({j, hub_row_[link], link, 0});
      continue;
    }
    for (std::size_t i = 0; i < at.size(); ++i)
      for (std::size_t k = i + 1; k < at.size(); ++k) couplings_.push_back({at[i], at[k], link, 0});
  }
  for (const Coupling& c : couplings_) pairs_.emplace_back(c.first, c.second);
  std::sort(pairs_.begin(), pairs_.end());
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  for (Coupling& c : couplings_)
    c.pair = static_cast<uint32_t>(
        std::lower_bound(pairs_.begin(), pairs_.end(), std::pair(c.first, c.second)) - pairs_.begin());
  kinds_.resize(joints_.size() + hubs_.size());
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto is_low = [&](uint32_t link) { return link != kDriven && !is_hub(link); };
    kinds_[j].is_empty = !is_low(joints_[j].a) && !is_low(joints_[j].b);
  }
  for (std::size_t h = joints_.size(); h < kinds_.size(); ++h) kinds_[h].is_negative = true;
  const auto rows = static_cast<uint32_t>(kinds_.size());
  if (is_small_)
    small_.factor.analyze(rows, pairs_);
  else
    large_.factor.analyze(rows, pairs_, kinds_);
  for (std::vector<Vec6>* v : {&residual_, &part_, &direction_, &product_}) v->resize(joints_.size());
}

bool JointSystem::factorize(std::span<const JointRows> rows, std::span<const LinkMobility> links) {
  rows_ = rows;
  links_.assign(links.begin(), links.end());
  response_a_.resize(rows.size());
  response_b_.resize(rows.size());
  is_factored_ = is_small_ ? factorize(small_) : factorize(large_);
  return is_factored_;
}

template <int N>
bool JointSystem::factorize(Matrix<N>& m) {
  using Block = Eigen::Matrix<Real, N, N>;
  m.diagonal.assign(kinds_.size(), Block::Zero());
  m.off.assign(pairs_.size(), Block::Zero());
  m.x.resize(kinds_.size());
  const auto respond = [&](uint32_t link, const Mat6& on, Mat6& response) {
    response.template topLeftCorner<3, N>() = links_[link].inverse_mass * on.template topLeftCorner<3, N>();
    response.template bottomLeftCorner<3, N>().noalias() =
        links_[link].inverse_inertia * on.template bottomLeftCorner<3, N>();
  };
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto add = [&](uint32_t link, const Mat6& on, Mat6& response) {
      if (link == kDriven) return;
      respond(link, on, response);
      if (!is_hub(link))
        m.diagonal[j].noalias() += on.template leftCols<N>().transpose() * response.template leftCols<N>();
    };
    add(joints_[j].a, rows_[j].on_a, response_a_[j]);
    add(joints_[j].b, rows_[j].on_b, response_b_[j]);
    m.diagonal[j].diagonal() += rows_[j].softness.template head<N>();
    for (auto i = static_cast<Eigen::Index>(rows_[j].count); i < N; ++i) m.diagonal[j](i, i) = 1;
  }
  for (const Coupling& c : couplings_) {
    const auto on = [&](uint32_t j) -> const Mat6& {
      return joints_[j].a == c.link ? rows_[j].on_a : rows_[j].on_b;
    };
    if (is_hub(c.link)) {
      if constexpr (N == 6) m.off[c.pair] += on(c.first).transpose();
      continue;
    }
    const Mat6& response = joints_[c.second].a == c.link ? response_a_[c.second] : response_b_[c.second];
    m.off[c.pair].noalias() +=
        on(c.first).template leftCols<N>().transpose() * response.template leftCols<N>();
  }
  if constexpr (N == 6)
    for (std::size_t h = 0; h < hubs_.size(); ++h) {
      Mat6& block = m.diagonal[joints_.size() + h];
      const LinkMobility& link = links_[hubs_[h]];
      block.diagonal().template head<3>().setConstant(-1 / link.inverse_mass);
      block.template bottomRightCorner<3, 3>() = -link.inverse_inertia.inverse();
    }
  needs_refinement_ = !is_plain();
  if (!needs_refinement_ && m.factor.factorize(m.diagonal, m.off)) return true;
  needs_refinement_ = true;
  Real fraction = kRegularization;
  for (int attempt = 0; attempt < kAttempts; ++attempt, fraction *= kMore) {
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      m.diagonal[j].diagonal() *= 1 + fraction;
      // The diagonal block of a joint between two hubs is empty. The addition is then a fraction of the block
      // that the joint would have without rows for hubs.
      if (kinds_[j].is_empty) m.diagonal[j].diagonal() += fraction * own_diagonal<N>(j);
    }
    if (m.factor.factorize(m.diagonal, m.off)) return true;
  }
  return false;
}

/// Returns the diagonal of a joint's block in a matrix for impulses: the joint's rows times the responses to
/// their impulses.
template <int N>
Eigen::Matrix<Real, N, 1> JointSystem::own_diagonal(std::size_t joint) const {
  Eigen::Matrix<Real, N, 1> sum = Eigen::Matrix<Real, N, 1>::Zero();
  const auto add = [&](uint32_t link, const Mat6& on, const Mat6& response) {
    if (link == kDriven) return;
    sum +=
        on.template leftCols<N>().cwiseProduct(response.template leftCols<N>()).colwise().sum().transpose();
  };
  add(joints_[joint].a, rows_[joint].on_a, response_a_[joint]);
  add(joints_[joint].b, rows_[joint].on_b, response_b_[joint]);
  return sum;
}

template <int N>
void JointSystem::solve(Matrix<N>& m, std::span<Vec6> x) {
  for (std::size_t j = 0; j < x.size(); ++j) m.x[j] = x[j].template head<N>();
  for (std::size_t h = x.size(); h < m.x.size(); ++h) m.x[h].setZero();
  m.factor.solve(m.x);
  for (std::size_t j = 0; j < x.size(); ++j) x[j].template head<N>() = m.x[j];
}

void JointSystem::solve(std::span<Vec6> x) {
  if (is_small_)
    solve(small_, x);
  else
    solve(large_, x);
}

void JointSystem::relative(std::span<const Vec6> velocities, std::span<Vec6> result) const {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    result[j].setZero();
    if (joints_[j].a != kDriven) result[j].noalias() += rows_[j].on_a.transpose() * velocities[joints_[j].a];
    if (joints_[j].b != kDriven) result[j].noalias() += rows_[j].on_b.transpose() * velocities[joints_[j].b];
  }
}

void JointSystem::apply(std::span<const Vec6> impulses, std::span<Vec6> velocities) const {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto [a, b, count] = joints_[j];
    if (a != kDriven) velocities[a] += links_[a].velocity(rows_[j].on_a * impulses[j]);
    if (b != kDriven) velocities[b] += links_[b].velocity(rows_[j].on_b * impulses[j]);
  }
}

/// Improves the impulses by conjugate gradients with the factorization as preconditioner. The eigenvalues of
/// the preconditioned matrix are 1, apart from the effect of the addition to the diagonal.
void JointSystem::refine(std::span<const Vec6> change, std::span<Vec6> impulses) {
  const auto dot = [](std::span<const Vec6> a, std::span<const Vec6> b) {
    Real sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
  };
  const auto multiply = [this](std::span<const Vec6> p, std::span<Vec6> result) {
    given_.assign(links_.size(), Vec6::Zero());
    apply(p, given_);
    relative(given_, result);
    for (std::size_t j = 0; j < p.size(); ++j) result[j] += rows_[j].softness.cwiseProduct(p[j]);
  };
  std::vector<Vec6>&r = residual_, &z = part_, &p = direction_, &q = product_;
  multiply(impulses, r);
  for (std::size_t j = 0; j < r.size(); ++j) r[j] = change[j] - r[j];
  const Real enough = kExact * kExact * dot(change, change);
  Real before = 0;
  for (int k = 0; k < kRefinements && dot(r, r) > enough; ++k) {
    z = r;
    solve(z);
    const Real now = dot(r, z);
    if (!(now > 0)) return;
    for (std::size_t j = 0; j < p.size(); ++j) p[j] = k == 0 ? z[j] : Vec6(z[j] + now / before * p[j]);
    before = now;
    multiply(p, q);
    const Real curvature = dot(p, q);
    // Directions in which the constraints have hardly any effect are skipped, because their impulses would
    // grow without limit. They arise from dependent rows that contradict each other, as in a straight chain
    // held at both ends.
    const Real length = now / curvature;
    if (!(curvature > 0) || length > kLongest) return;
    for (std::size_t j = 0; j < p.size(); ++j) {
      impulses[j] += length * p[j];
      r[j] -= length * q[j];
    }
  }
}

void JointSystem::correct(std::span<const Vec6> change, std::span<Vec6> impulses,
                          std::span<Vec6> velocities) {
  std::fill(impulses.begin(), impulses.end(), Vec6::Zero());
  if (!is_factored_) return;
  std::copy(change.begin(), change.end(), impulses.begin());
  solve(impulses);
  if (needs_refinement_) refine(change, impulses);
  apply(impulses, velocities);
}

}  // namespace offstage::sim
