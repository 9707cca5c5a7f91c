#include "sim/cloth/taut_springs.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

/// If a spring was beyond its target length at the start of the sub-step, it keeps this fraction of its
/// excess. A body that hangs on it is stopped, but not thrown back.
constexpr Real kKeepsBeyondAim = 0.9;
/// A spring takes part if its elongation is above this fraction of the allowed elongation, because the
/// impulses of other springs may make it too long.
constexpr Real kNearLimit = 0.3;
/// Accepted excess of a spring, as a fraction of the greatest initial excess.
constexpr Real kLeftOfExcess = 3e-3;
constexpr int kMaxSets = 12, kMaxTautIterations = 200;

}  // namespace

TautSprings::TautSprings(const ClothPoints& points, std::span<const Carrier> carriers)
    : points_(points), place_(points.size(), kNone) {
  for (const Carrier& carrier : carriers) {
    const Mat6 carried = carrier.carried(points);
    const auto body = static_cast<uint32_t>(bodies_.size());
    bodies_.push_back({carrier.body, &carrier, carried, carrier.body->mobility(carried)});
    for (uint32_t i : carrier.points) {
      place_[i] = static_cast<uint32_t>(places_.size());
      places_.push_back({i, body, points.at(i) - carrier.body->centre()});
    }
  }
}

uint32_t TautSprings::place_of(uint32_t point) {
  if (place_[point] == kNone) {
    place_[point] = static_cast<uint32_t>(places_.size());
    places_.push_back({point, kNone, Vec3::Zero()});
  }
  return place_[point];
}

uint32_t TautSprings::mean_place(const BodyContact& contact) {
  MeanPlace mean{0, {}, contact.weights};
  for (std::size_t k = 0; k < 3; ++k) mean.corners[k] = place_of(contact.points[k]);
  mean.place = static_cast<uint32_t>(places_.size());
  places_.push_back({kNone, kNone, Vec3::Zero()});
  mean_places_.push_back(mean);
  return mean.place;
}

Real TautSprings::compliance_at(uint32_t place, const Vec4& direction) const {
  const Place& at = places_[place];
  if (at.point == kNone && at.body == kNone) {
    // Corners on the same body are treated as independent: the value is used only for scaling and
    // preconditioning.
    const MeanPlace& mean = *std::ranges::find(mean_places_, place, &MeanPlace::place);
    Real sum = 0;
    for (std::size_t k = 0; k < 3; ++k)
      sum += mean.weights[k] * mean.weights[k] * compliance_at(mean.corners[k], direction);
    return sum;
  }
  if (at.body == kNone) return points_.inverse_mass[at.point];
  const Vec3 u = direction.head<3>();
  const Vec6 push = (Vec6() << u, at.arm.cross(u)).finished();
  return push.dot(bodies_[at.body].mobility * push);
}

void TautSprings::add_row(uint32_t first, uint32_t second, const Vec4& direction, Real excess) {
  const Real compliance = compliance_at(first, direction) + compliance_at(second, direction);
  if (!(compliance > 0)) return;
  greatest_ = std::max(greatest_, excess);
  rows_.push_back({first, second, direction, excess, compliance, excess > 0});
}

void TautSprings::add(const SpringLimit& l) {
  if (l.tears) return;
  const Vec4 d = points_.position[l.a] - points_.position[l.b];
  const Real near = l.rest + kNearLimit * (l.longest - l.rest);
  if (d.squaredNorm() <= near * near) return;
  const Real length = d.norm();
  if (!(length > 0)) return;
  any_too_long_ |= length > l.longest;
  const Real start = std::min((points_.start[l.a] - points_.start[l.b]).norm(), l.longest);
  const Real aim = l.rest + kStretchAim * (l.longest - l.rest);
  add_row(place_of(l.b), place_of(l.a), d / length,
          length - aim - kKeepsBeyondAim * std::max(start - aim, 0.0));
}

void TautSprings::add(const BodyContact& contact) {
  auto at = std::ranges::find(bodies_, contact.body, &MovedBody::body);
  if (at == bodies_.end())
    at = bodies_.insert(at, {contact.body, nullptr, Mat6::Zero(), contact.body->mobility(Mat6::Zero())});
  const auto spot = static_cast<uint32_t>(places_.size());
  places_.push_back(
      {kNone, static_cast<uint32_t>(at - bodies_.begin()), contact.on_body - at->body->centre()});
  const uint32_t place = contact.weights[0] == 1 ? place_of(contact.points[0]) : mean_place(contact);
  add_row(place, spot, padded(contact.normal), -contact.gap);
}

/// Adds up the impulses on each place and each body.
void TautSprings::gather(std::span<const Real> impulses) {
  moves_.assign(places_.size(), Vec4::Zero());
  impulses_.assign(bodies_.size(), Vec6::Zero());
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    if (impulses[k] == 0) continue;
    moves_[rows_[k].first] += impulses[k] * rows_[k].direction;
    moves_[rows_[k].second] -= impulses[k] * rows_[k].direction;
  }
  for (const MeanPlace& mean : mean_places_)
    for (std::size_t k = 0; k < 3; ++k) moves_[mean.corners[k]] += mean.weights[k] * moves_[mean.place];
  for (std::size_t k = 0; k < places_.size(); ++k) {
    if (places_[k].body == kNone) continue;
    const Vec3 push = moves_[k].head<3>();
    impulses_[places_[k].body] += (Vec6() << push, places_[k].arm.cross(push)).finished();
  }
}

/// Computes y = J W J^T x.
void TautSprings::multiply(std::span<const Real> x, std::span<Real> y) {
  gather(x);
  for (std::size_t b = 0; b < bodies_.size(); ++b) impulses_[b] = bodies_[b].mobility * impulses_[b];
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Place& at = places_[k];
    if (at.body == kNone && at.point == kNone) continue;
    if (at.body == kNone)
      moves_[k] *= points_.inverse_mass[at.point];
    else
      moves_[k] = padded(impulses_[at.body].head<3>() + impulses_[at.body].tail<3>().cross(at.arm));
  }
  for (const MeanPlace& mean : mean_places_) {
    moves_[mean.place].setZero();
    for (std::size_t k = 0; k < 3; ++k) moves_[mean.place] += mean.weights[k] * moves_[mean.corners[k]];
  }
  for (std::size_t k = 0; k < rows_.size(); ++k)
    y[k] = rows_[k].direction.dot(moves_[rows_[k].first] - moves_[rows_[k].second]);
}

/// Solves for the rows of the acting set by conjugate gradients. Returns false if the limit of iterations was
/// reached.
bool TautSprings::solve_acting() {
  const std::size_t n = rows_.size();
  Real worst = 0;
  const auto scale = [&] {
    Real sum = 0;
    worst = 0;
    for (std::size_t k = 0; k < n; ++k) {
      if (!rows_[k].acts) residual_[k] = 0;
      scaled_[k] = residual_[k] / rows_[k].compliance;
      sum += residual_[k] * scaled_[k];
      worst = std::max(worst, std::abs(residual_[k]));
    }
    return sum;
  };
  multiply(lambda_, image_);
  for (std::size_t k = 0; k < n; ++k) residual_[k] = rows_[k].excess - image_[k];
  Real rz = scale();
  direction_ = scaled_;
  for (int i = 0; i < kMaxTautIterations; ++i) {
    if (worst <= kLeftOfExcess * greatest_) return true;
    multiply(direction_, image_);
    Real curvature = 0;
    for (std::size_t k = 0; k < n; ++k) curvature += direction_[k] * image_[k];
    if (!(curvature > 0)) return true;
    const Real step = rz / curvature;
    for (std::size_t k = 0; k < n; ++k) {
      lambda_[k] += step * direction_[k];
      residual_[k] -= step * image_[k];
    }
    const Real next = scale(), ratio = next / rz;
    rz = next;
    for (std::size_t k = 0; k < n; ++k) direction_[k] = scaled_[k] + ratio * direction_[k];
  }
  return false;
}

/// Removes rows with an impulse in the wrong direction from the acting set, and adds rows with an excess.
/// Returns whether the set changed.
bool TautSprings::change_set() {
  bool changed = false;
  for (std::size_t k = 0; k < rows_.size(); ++k)
    if (rows_[k].acts && lambda_[k] < 0) {
      rows_[k].acts = false;
      lambda_[k] = 0;
      changed = true;
    }
  multiply(lambda_, image_);
  for (std::size_t k = 0; k < rows_.size(); ++k)
    if (!rows_[k].acts && rows_[k].excess - image_[k] > kLeftOfExcess * greatest_) {
      rows_[k].acts = true;
      changed = true;
    }
  return changed;
}

void TautSprings::solve() {
  for (auto* values : {&lambda_, &residual_, &direction_, &image_, &scaled_}) values->assign(rows_.size(), 0);
  for (int set = 0; set < kMaxSets; ++set)
    if (!solve_acting() || !change_set()) break;
  for (Real& impulse : lambda_) impulse = std::max(impulse, 0.0);
  // A solution that reached the limit of sets or iterations must not add energy. So it is scaled by the
  // factor with the least energy.
  multiply(lambda_, image_);
  Real gain = 0, curvature = 0;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    gain += lambda_[k] * rows_[k].excess;
    curvature += lambda_[k] * image_[k];
  }
  const Real scale = curvature > 0 ? std::clamp(gain / curvature, 0.0, 1.0) : 0;
  for (Real& impulse : lambda_) impulse *= scale;
}

/// Returns the greatest c in [0, 1] for which c times the gathered impulses p adds no kinetic energy to the
/// velocities v: c p.v + c^2 p.W p / 2 <= 0, where W is the inverse mass matrix. Otherwise energy would come
/// from impulses that correct an error of earlier sub-steps, such as an overlap that already existed. Moving
/// pins may add energy, because the object that moves them does work.
Real TautSprings::velocity_fraction(Real dt, std::span<const Vec4> kick,
                                    std::span<const VelocityCut> cuts) const {
  Real work = 0, inertial = 0;
  std::vector<Vec4> cut(places_.size(), Vec4::Zero());
  for (const VelocityCut& c : cuts)
    if (place_[c.point] != kNone) cut[place_[c.point]] += c.move;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Place& at = places_[k];
    if (at.body != kNone || at.point == kNone) continue;
    const Vec4 move = points_.position[at.point] - points_.start[at.point] + dt * kick[at.point] - cut[k];
    work += moves_[k].dot(move);
    inertial += points_.inverse_mass[at.point] * moves_[k].squaredNorm();
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const ClothBody& body = *bodies_[b].body;
    const Vec6 move = dt * (Vec6() << body.velocity(body.centre()), body.angular_velocity()).finished();
    work += impulses_[b].dot(move);
    inertial += impulses_[b].dot(bodies_[b].mobility * impulses_[b]);
  }
  return inertial > 0 ? std::clamp(-2 * work / inertial, 0.0, 1.0) : 1;
}

void TautSprings::apply(ClothPoints& points, Real dt, std::span<const Vec4> kick,
                        std::vector<VelocityCut>& cuts) {
  gather(lambda_);
  const Real fraction = velocity_fraction(dt, kick, cuts);
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Place& at = places_[k];
    if (at.body != kNone || at.point == kNone) continue;
    const Vec4 move = points.inverse_mass[at.point] * moves_[k];
    points.position[at.point] += move;
    if (fraction < 1 && !move.isZero(0)) cuts.push_back({at.point, (1 - fraction) * move});
    if (points.inverse_mass[at.point] == 0) points.pin_impulse[at.point] += fraction * moves_[k];
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (impulses_[b] == Vec6::Zero()) continue;
    const Vec6 moving = impulses_[b] / dt, impulse = fraction * moving;
    if (bodies_[b].carrier)
      bodies_[b].carrier->apply_impulses(impulse, moving, points);
    else
      bodies_[b].body->apply_pin_impulses(impulse, moving, bodies_[b].carried);
  }
}

}  // namespace offstage::sim
