#include "sim/contact/sprung_paths.h"

#include <algorithm>
#include <cmath>

#include "sim/contact/contact_terms.h"
#include "sim/dynamics/free_body.h"

namespace offstage::sim {
namespace {

/// kPasses: greatest number of passes over the contacts. They end earlier if the deviation at each contact is
/// less than kEnough [m].
constexpr int kPasses = 30;
constexpr Real kEnough = 1e-9;
/// If friction is below this fraction of its limit, it holds the bodies together at the contact.
constexpr Real kHolds = 0.99;

bool sticks(const PairSurface& surface, const Vec3& force) {
  return std::hypot(force.y(), force.z()) < kHolds * surface.static_friction * force.x();
}

}  // namespace

SprungPaths::SprungPaths(std::span<Island* const> islands, Real duration)
    : islands_(islands), duration_(duration) {
  for (const Island* island : islands)
    for (Body* body : island->bodies) {
      if (!body->has_motion_forces) continue;
      const RigidBody& end = body->rigid;
      const Twist& start = body->start_twist;
      Path path{body};
      path.shift = end.position - body->start.position - duration / 2 * (start.velocity + end.velocity());
      path.turn = rotation_vector(body->start.orientation, end.orientation) -
                  duration / 2 * (start.angular_velocity + end.angular_velocity());
      path.shift_before = path.shift;
      path.turn_before = path.turn;
      path.free = {end.velocity(), end.angular_velocity()};
      path.inverse_inertia = inverse_inertia(end, end.orientation);
      paths_.push_back(path);
    }
  std::sort(paths_.begin(), paths_.end(),
            [](const Path& a, const Path& b) { return a.body->rank < b.body->rank; });
}

SprungPaths::Path* SprungPaths::path_of(const Body& body) {
  const auto at = std::lower_bound(paths_.begin(), paths_.end(), body.rank,
                                   [](const Path& p, uint32_t rank) { return p.body->rank < rank; });
  return at != paths_.end() && at->body == &body ? &*at : nullptr;
}

/// Returns the point at `place` where a contact holds the bodies of two paths along a direction. Either path
/// may be null.
SprungPaths::Held SprungPaths::hold(const std::array<Path*, 2>& paths, const Vec3& place,
                                    const Vec3& direction) {
  Held h;
  for (std::size_t i = 0; i < 2; ++i) {
    if (!paths[i]) continue;
    const Vec3 d = i == 0 ? direction : Vec3(-direction);
    const Vec3 turning = (place - paths[i]->body->start.position).cross(d);
    h.ends[i] = {paths[i], d, turning};
    h.mobility += 1 / paths[i]->body->rigid.mass + turning.dot(paths[i]->inverse_inertia * turning);
  }
  return h;
}

void SprungPaths::keep_on_contacts() {
  if (paths_.empty() || duration_ <= 0) return;
  std::vector<Held> held;
  for (const Island* island : islands_)
    for (const ContactPair* pair : island->pairs) {
      const std::array<Path*, 2> paths = {path_of(pair->a()), path_of(pair->b())};
      if (!paths[0] && !paths[1]) continue;
      for (const PlacedManifold& m : pair->manifolds())
        for (uint32_t k = 0; k < m.manifold.count; ++k) {
          if (!(m.forces[k].now.x() > 0)) continue;
          const Vec3 place = (m.manifold.points[k].on_a + m.manifold.points[k].on_b) / 2;
          held.push_back(hold(paths, place, m.frame.n));
          if (!sticks(pair->surface(), m.forces[k].now)) continue;
          held.push_back(hold(paths, place, m.frame.t));
          held.push_back(hold(paths, place, m.frame.k));
        }
    }
  Real largest = 2 * kEnough;
  for (int pass = 0; pass < kPasses && largest > kEnough; ++pass) {
    largest = 0;
    for (const Held& h : held) {
      Real deviation = 0;
      for (const Held::End& end : h.ends)
        if (end.path) deviation += end.direction.dot(end.path->shift) + end.turning.dot(end.path->turn);
      largest = std::max(largest, std::abs(deviation));
      for (const Held::End& end : h.ends) {
        if (!end.path) continue;
        end.path->shift -= deviation / h.mobility / end.path->body->rigid.mass * end.direction;
        end.path->turn -= deviation / h.mobility * (end.path->inverse_inertia * end.turning);
      }
    }
  }
  for (const Path& path : paths_) {
    Body& body = *path.body;
    body.held.set({(body.rigid.velocity() - path.free.velocity) / duration_,
                   (body.rigid.angular_velocity() - path.free.angular_velocity) / duration_});
    body.rigid.position += path.shift - path.shift_before;
    body.rigid.orientation =
        (rotation(path.turn - path.turn_before, 1) * body.rigid.orientation).normalized();
    body.pose = body.rigid.pose();
  }
}

}  // namespace offstage::sim
