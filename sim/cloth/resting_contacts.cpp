#include "sim/cloth/resting_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace offstage::sim {
namespace {

/// The sweeps end when the velocities change by less than this fraction of the velocity gained.
constexpr Real kAccuracy = 1e-9;
/// Sweeps for the mobility in one direction, which needs no accuracy.
constexpr int kMobilitySweeps = 8;
/// Contacts that this mobility takes into account. Without further ones, it is greater.
constexpr std::size_t kMostClosed = 16;
/// A body does not move along a row whose mobility is less than this fraction of the sum of its mobilities.
constexpr Real kImmovable = 1e-12;
/// Stiffness of the contacts in the matrix for held contacts, relative to the body's own inertia there.
constexpr Real kHeld = 1e6;

}  // namespace

RestingContacts::RestingContacts(std::vector<RestingContact> contacts, const Mat6& mobility)
    : contacts_(std::move(contacts)), rows_(contacts_.size()) {
  const auto set = [](Row& row, const Vec3& arm, const Vec3& axis) {
    row.direction << axis, arm.cross(axis);
  };
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const RestingContact& c = contacts_[i];
    const Vec3 t = c.normal.unitOrthogonal();
    set(rows_[i].normal, c.arm, c.normal);
    set(rows_[i].t, c.arm, t);
    set(rows_[i].k, c.arm, c.normal.cross(t));
  }
  set_mobility(mobility);
}

void RestingContacts::set_mobility(const Mat6& mobility) {
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    for (Row* row : {&rows_[i].normal, &rows_[i].t, &rows_[i].k}) {
      row->response = mobility * row->direction;
      row->mobility = row->direction.dot(row->response) + contacts_[i].yield;
      // Joints may hold the body along the row, so that the contact has no effect.
      if (row->direction.dot(row->response) > kImmovable * mobility.trace()) continue;
      row->response.setZero();
      row->mobility = kInfinity;
    }
}

Vec3 RestingContacts::impulse(std::size_t k) const {
  const Vec3& of = contacts_[k].impulse;
  const Vec6 sum =
      of.x() * rows_[k].normal.direction + of.y() * rows_[k].t.direction + of.z() * rows_[k].k.direction;
  return sum.head<3>();
}

Vec6 RestingContacts::respond(Vec6& gained, int sweeps) {
  is_fresh_ = false;
  Vec6 sum = Vec6::Zero();
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    Real changed = 0;
    const auto push = [&](const Row& r, Real& impulse, Real next) {
      const Real change = next - std::exchange(impulse, next);
      if (change == 0) return;
      sum += change * r.direction;
      gained += change * r.response;
      changed = std::max(changed, std::abs(change) * r.mobility);
    };
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      RestingContact& c = contacts_[i];
      const auto& [n, t, k] = rows_[i];
      // The impulse that would end the approach along the row.
      const auto ideal = [&](const Row& r, Real impulse, Real slack) {
        return impulse - (r.direction.dot(gained) + c.yield * impulse + slack) / r.mobility;
      };
      push(n, c.impulse.x(), std::max(ideal(n, c.impulse.x(), c.slack), 0.0));
      const Real most = c.friction * std::max(c.load, c.impulse.x());
      if (!(most > 0)) continue;
      const Real along = ideal(t, c.impulse.y(), 0), across = ideal(k, c.impulse.z(), 0);
      const Real length = std::hypot(along, across), part = length > most ? most / length : 1;
      push(t, c.impulse.y(), part * along);
      push(k, c.impulse.z(), part * across);
    }
    if (!(changed > kAccuracy * gained.head<3>().norm())) break;
  }
  return sum;
}

Real RestingContacts::mobility(const Vec6& gained, const Vec6& push, Vec6 response) const {
  // The contacts that the push may close, with their impulses.
  std::array<std::pair<const Row*, Real>, kMostClosed> closed;
  std::size_t count = 0;
  for (std::size_t i = 0; i < contacts_.size() && count < closed.size(); ++i) {
    const RestingContact& c = contacts_[i];
    const Row& n = rows_[i].normal;
    if (n.response.isZero(0)) continue;
    if (n.direction.dot(gained) + c.yield * c.impulse.x() + c.slack <= tight_) closed[count++] = {&n, 0};
  }
  Real changed = 1;
  for (int sweep = 0; sweep < kMobilitySweeps && changed > 0; ++sweep) {
    changed = 0;
    for (auto& [n, impulse] : std::span(closed).first(count)) {
      const Real yield = n->mobility - n->direction.dot(n->response);  // of the other body
      const Real next = std::max(impulse - (n->direction.dot(response) + yield * impulse) / n->mobility, 0.0);
      response += (next - impulse) * n->response;
      changed = std::max(changed, std::abs(next - std::exchange(impulse, next)));
    }
  }
  return std::max(push.dot(response), 0.0);
}

Mat6 RestingContacts::held_mobility(const Mat6& mobility) const {
  Mat6 result = mobility;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const RestingContact& c = contacts_[i];
    if (rows_[i].normal.response.isZero(0)) continue;
    if (!(c.impulse.x() > 0 || (is_fresh_ && c.load > 0 && c.slack <= tight_))) continue;
    // Sherman-Morrison: the inertia grows along the normal.
    const Vec6& n = rows_[i].normal.direction;
    const Vec6 response = result * n;
    const Real held = c.yield + n.dot(mobility * n) / kHeld;
    result -= response * response.transpose() / (n.dot(response) + held);
  }
  return result;
}

RestingContacts RestingContacts::scaled(Real factor) const {
  RestingContacts result = *this;
  result.tight_ *= factor;
  for (RestingContact& c : result.contacts_) {
    c.slack *= factor;
    c.load *= factor;
    c.impulse *= factor;
  }
  return result;
}

}  // namespace offstage::sim
