#include "sim/cloth/cloth_contacts.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <oneapi/tbb/parallel_for.h>

#include "sim/cloth/triangle_contact.h"
#include "sim/collision/sphere_sweep.h"

namespace offstage::sim {
namespace {

constexpr std::size_t kChunk = 1024;
/// Fraction of an overlap that is removed per sub-step of the world where a body lies on supported cloth. It
/// is small, because the world moves the body only one sub-step later.
constexpr Real kStabilization = 0.3;
/// Two normals face each other if the cosine of their angle is below this. Cloth between them is pinched.
constexpr Real kFacing = -0.5;
constexpr int kStopSweeps = 30;
/// A point between two bodies that press cloth is under their load if its distance from both is at most this,
/// in thicknesses.
constexpr Real kUnderLoad = 1.2;
/// Two bodies that press cloth are at the same height if the sine of the slope of the line between them is
/// less than this.
constexpr Real kLevel = 1e-3;
/// A point that its support keeps at the right distance but for rounding touches the body, in thicknesses.
constexpr Real kTouching = 1e-6;
/// How fast the distance that points keep from a body may grow with their distance from a pin at its surface.
/// Cloth that rises at this slope from a pin is stretched by 4 %.
constexpr Real kSlopeAtPin = 0.3;

/// Slows the sliding of a body on another one by at most the impulse `most` [N s]. `b`: null for what does
/// not move.
void rub(ClothBody& a, const Vec3& on_a, ClothBody* b, const Vec3& on_b, const Vec3& normal, Real most) {
  const Vec3 relative = a.velocity(on_a) - (b ? b->velocity(on_b) : Vec3(Vec3::Zero()));
  const Vec3 slip = relative - normal.dot(relative) * normal;
  const Real speed = slip.norm();
  if (!(speed > 0) || !(most > 0)) return;
  const Vec3 along = slip / speed;
  const Real mobility = a.mobility(on_a, along) + (b ? b->mobility(on_b, -along) : 0);
  if (!(mobility > 0)) return;
  const Real held = std::min(speed / mobility, most);
  a.apply_impulse(-held * along, on_a);
  if (b) b->apply_impulse(held * along, on_b);
}

}  // namespace

/// Finds the bodies near a point. Near means within twice the distance that the two move relative to each
/// other at their current speeds in a sub-step.
void ClothContacts::look(const ClothPoints& points, uint32_t i, std::vector<Near>& found) const {
  const Vec3 p = points.at(i);
  const Vec3 v = points.velocity[i].head<3>();
  for (uint32_t b = 0; b < bodies_.size(); ++b) {
    if (!bodies_[b].collides) continue;
    const Obstacle& obstacle = bodies_[b].obstacle();
    const Real reach = seen_reach_[i];
    if (boxes_[b].squaredExteriorDistance(p) > (reach + points.thickness[i]) * (reach + points.thickness[i]))
      continue;
    const Vec3 place = bodies_[b].end().point_to_body(p);
    const SurfaceDistance s = signed_distance(obstacle.solid, place);
    const Real relative = (v - obstacle.velocity_at(p, 0)).norm() * h_;
    if (s.distance < points.thickness[i] + 2 * relative + reach)
      found.push_back({i, b, place, s.distance, points.thickness[i]});
  }
}

void ClothContacts::find(const ClothPoints& points, std::span<const uint8_t> collides,
                         std::span<ClothBody> bodies, Real h, Real at) {
  bodies_ = bodies;
  collides_ = collides;
  active_.assign(points.cloth.empty() ? 0 : points.cloth.back() + 1, 0);
  touched_.assign(active_.size(), 0);
  pinned_.assign(active_.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!(points.inverse_mass[i] > 0)) pinned_[points.cloth[i]] = 1;
  h_ = h;
  near_.clear();
  boxes_.clear();
  for (ClothBody& body : bodies) {
    body.begin(at, at, 0);
    boxes_.push_back(body.obstacle().swept_bounds());
  }
  seen_at_.resize(points.size());
  seen_reach_.resize(points.size());
  std::vector<std::vector<Near>> found((points.size() + kChunk - 1) / kChunk);
  const auto chunk = [&](std::size_t c) {
    for (std::size_t i = c * kChunk, end = std::min(points.size(), i + kChunk); i < end; ++i) {
      seen_at_[i] = points.at(i);
      // Acceleration may add this distance; gravity alone adds 0.2 mm in 1/240 s.
      seen_reach_[i] = points.thickness[i] + 2 * h * points.velocity[i].norm();
      if (collides[i]) look(points, static_cast<uint32_t>(i), found[c]);
    }
  };
  if (bodies.empty()) return;
  tbb::parallel_for(std::size_t{0}, found.size(), chunk);
  for (const auto& f : found) near_.insert(near_.end(), f.begin(), f.end());
  find_held_inside(points);
  count_points_under_loads(points);
}

/// Finds the pinned points that are closer to a body than the thickness because they were placed there, and
/// the distances that other points can keep. A dynamic body that does not hold the pin moved there itself,
/// and is moved back.
void ClothContacts::find_held_inside(const ClothPoints& points) {
  held_inside_.assign(bodies_.size(), {});
  bool any = false;
  for (const Near& near : near_) {
    const uint32_t i = near.point;
    const ClothBody& body = bodies_[near.body];
    if (points.inverse_mass[i] > 0 || !(near.distance < points.thickness[i])) continue;
    if (body.is_dynamic() && points.holder[i] != &body) continue;
    HeldPoints& held = held_inside_[near.body];
    held.points.push_back({i, near.distance});
    held.deepest = std::max(held.deepest, -near.distance);
    any = true;
  }
  if (!any) return;
  for (HeldPoints& held : held_inside_)
    std::ranges::stable_sort(held.points, {}, [&](const HeldInside& h) { return points.rest[h.point].x(); });
  for (Near& near : near_) near.least_distance = kept_distance(points, near.body, near.point);
}

/// Returns the distance that a free point can keep from a body. Near a pin inside the body, this is less than
/// the thickness: contacts that push the point farther out would only stretch the cloth, and the springs
/// would turn the displacement into energy.
Real ClothContacts::kept_distance(const ClothPoints& points, uint32_t body, uint32_t point) const {
  const Real thickness = points.thickness[point];
  Real least = thickness;
  const std::vector<HeldInside>& held = held_inside_[body].points;
  if (held.empty() || !(points.inverse_mass[point] > 0)) return least;
  const Real reach = thickness / kSlopeAtPin + held_inside_[body].deepest;
  const auto x = [&](const HeldInside& h) { return points.rest[h.point].x(); };
  const Real own = points.rest[point].x();
  for (auto h = std::ranges::lower_bound(held, own - reach, {}, x); h != held.end() && x(*h) <= own + reach;
       ++h) {
    if (points.cloth[h->point] != points.cloth[point]) continue;
    // Length of cloth from the surface to the point.
    const Real outside = (points.rest[h->point] - points.rest[point]).norm() + std::min(h->distance, 0.0);
    least = std::min(least, outside < 0 ? outside : std::max(h->distance, 0.0) + kSlopeAtPin * outside);
  }
  return least;
}

bool ClothContacts::is_held_inside(const ClothPoints& points, uint32_t body, uint32_t point) const {
  if (held_inside_.empty() || held_inside_[body].points.empty()) return false;
  const Real least = kTriangleDistance * points.thickness[point];
  if (points.inverse_mass[point] > 0) return kept_distance(points, body, point) < least;
  return std::ranges::any_of(held_inside_[body].points,
                             [&](const HeldInside& h) { return h.point == point && h.distance < least; });
}

void ClothContacts::count_points_under_loads(const ClothPoints& points) {
  if (std::ranges::all_of(bodies_, [](const ClothBody& body) { return body.loads.empty(); })) return;
  for (ClothBody& body : bodies_)
    for (ClothBody::Load& load : body.loads) load.points = 0;
  const auto is_under_load = [&](const Near& near) {
    return !bodies_[near.body].loads.empty() && near.distance < kUnderLoad * points.thickness[near.point];
  };
  for (std::size_t k = 0; k < near_.size(); ++k)
    for (std::size_t l = k + 1; l < near_.size() && near_[l].point == near_[k].point; ++l) {
      if (!is_under_load(near_[k]) || !is_under_load(near_[l])) continue;
      ClothBody &a = bodies_[near_[k].body], &b = bodies_[near_[l].body];
      for (auto& [body, other] : {std::pair(&a, &b), std::pair(&b, &a)})
        for (ClothBody::Load& load : body->loads)
          if (load.body == other->obstacle().body) ++load.points;
    }
}

Real ClothContacts::fastest_approach(const ClothPoints& points) const {
  Real fastest = 0;
  for (const Near& near : near_) {
    const ClothBody& body = bodies_[near.body];
    if (!body.is_dynamic()) continue;
    const Vec3 velocity = points.velocity[near.point].head<3>();
    fastest = std::max(fastest, (velocity - body.obstacle().velocity_at(points.at(near.point), 0)).norm());
  }
  return fastest;
}

void ClothContacts::find_runaways(const ClothPoints& points) {
  if (bodies_.empty()) return;
  std::vector<Near> found;
  for (uint32_t i = 0; i < points.size(); ++i) {
    const Vec3 p = points.at(i);
    if ((p - seen_at_[i]).squaredNorm() <= seen_reach_[i] * seen_reach_[i] || !collides_[i]) continue;
    seen_reach_[i] = points.thickness[i] + 2 * h_ * points.velocity[i].norm();
    seen_at_[i] = p;
    look(points, i, found);
  }
  if (found.empty()) return;
  const auto same = [](const Near& a, const Near& b) { return a.point == b.point && a.body == b.body; };
  const auto before = [](const Near& a, const Near& b) {
    return a.point != b.point ? a.point < b.point : a.body < b.body;
  };
  for (Near& near : found) near.least_distance = kept_distance(points, near.body, near.point);
  near_.insert(near_.end(), found.begin(), found.end());
  std::stable_sort(near_.begin(), near_.end(), before);
  near_.erase(std::unique(near_.begin(), near_.end(), same), near_.end());
}

/// Returns whether a point that moves to `at` comes nearer to a body than Near::least_distance plus `reach`,
/// or goes through the body's surface. Sets `t`.
bool ClothContacts::touch(const ClothPoints& points, Near& near, const Vec3& at, Real reach, Touch& t) const {
  ClothBody& body = bodies_[near.body];
  const Real thickness = points.thickness[near.point];
  const Vec3 place = body.end().point_to_body(at);
  // The distance changes at most by the move of the point.
  const Real moved = (place - near.place).norm();
  if (near.distance - moved >= near.least_distance + reach) return false;
  const Vec3 from = body.start().point_to_body(points.start_at(near.point));
  t.near = &near;
  t.body = &body;
  const bool comes_from_outside = near.least_distance > thickness / 4;
  if (comes_from_outside && (place - from).squaredNorm() > thickness * thickness / 4) {
    if (const auto hit = sweep_sphere(body.solid(), from, place, thickness / 4)) {
      const Vec3 centre = from + hit->fraction * (place - from);
      t.gap = hit->normal.dot(place - centre) + hit->distance - near.least_distance;
      t.normal = body.end().vector_to_world(hit->normal);
      t.on_body = body.end().point_to_world(centre - hit->distance * hit->normal);
      near.place = place;
      near.distance = -2 * thickness;  // the distance is unknown: the point may be on the far side
      return t.gap < reach;
    }
  }
  const SurfaceDistance s = signed_distance(body.solid(), place);
  near.place = place;
  near.distance = s.distance;
  t.gap = s.distance - near.least_distance;
  if (!(t.gap < reach)) return false;
  t.normal = body.end().vector_to_world(s.normal);
  t.on_body = body.end().point_to_world(place - s.distance * s.normal);
  return true;
}

void ClothContacts::collect(const ClothPoints& points, std::vector<BodyContact>& found) {
  for (Near& near : near_) {
    ClothBody& body = bodies_[near.body];
    Touch t;
    if (!body.is_dynamic() || !(points.inverse_mass[near.point] > 0)) continue;
    if (!touch(points, near, points.at(near.point), points.thickness[near.point], t)) continue;
    // An initial overlap is removed slowly, because the correction counts as velocity.
    const Vec3 motion =
        points.at(near.point) - points.start_at(near.point) - body.surface_motion(t.on_body, t.normal);
    const Real before = std::min(t.gap - t.normal.dot(motion), 0.0);
    found.push_back({{near.point, near.point, near.point},
                     {1, 0, 0},
                     &body,
                     t.normal,
                     t.on_body,
                     t.gap - (1 - kTautRecovery) * before});
  }
}

bool ClothContacts::may_support(const ClothPoints& points, const ClothBody& body, uint32_t point) const {
  if (!body.is_dynamic()) return true;
  const auto near = std::ranges::equal_range(near_, point, {}, &Near::point);
  return !pinned_[points.cloth[point]] &&
         std::ranges::all_of(near, [&](const Near& n) { return &bodies_[n.body] == &body; });
}

bool ClothContacts::is_pressed_by(const ClothPoints& points, const ClothBody& body, uint32_t point) const {
  if (body.loads.empty()) return false;
  return std::ranges::any_of(std::ranges::equal_range(near_, point, {}, &Near::point), [&](const Near& near) {
    return near.distance < kUnderLoad * points.thickness[point] && body.load_against(bodies_[near.body]);
  });
}

bool ClothContacts::is_close(const ClothPoints& points, uint32_t body, uint32_t point) const {
  return std::ranges::any_of(std::ranges::equal_range(near_, point, {}, &Near::point), [&](const Near& near) {
    return near.body == body && near.distance < 2 * points.thickness[point];
  });
}

/// Returns whether a body presses a point against another one from above. Only the lower body then moves the
/// point, because it carries the weight. Of two bodies at the same height, or without gravity, the second one
/// of the list counts as the upper one. `normal`: from the body to the point.
bool ClothContacts::presses_from_above(const ClothPoints& points, const ClothBody& body, uint32_t point,
                                       const Vec3& normal) const {
  if (body.loads.empty()) return false;
  const Real height = normal.dot(up_), level = kLevel * up_.norm();
  if (height > level) return false;
  if (height < -level) return is_pressed_by(points, body, point);
  return std::ranges::any_of(std::ranges::equal_range(near_, point, {}, &Near::point), [&](const Near& near) {
    return near.distance < kUnderLoad * points.thickness[point] && &bodies_[near.body] < &body &&
           body.load_against(bodies_[near.body]);
  });
}

/// Returns the force with which another body presses a point against the body of `near`, for friction [N].
Real ClothContacts::load_on(const ClothPoints& points, const Near& near) const {
  Real sum = 0;
  for (const ClothBody::Load& load : bodies_[near.body].loads) {
    if (!load.has_friction || !(load.points > 0)) continue;
    for (const Near& other : std::ranges::equal_range(near_, near.point, {}, &Near::point))
      if (bodies_[other.body].obstacle().body == load.body &&
          other.distance < kUnderLoad * points.thickness[near.point])
        sum += load.impulse / load.points / h_;
  }
  return sum;
}

void ClothContacts::find_supports(ClothPoints& points, Real dt) {
  points.supports.clear();
  for (Near& near : near_) {
    near.friction_applied = false;
    const uint32_t i = near.point;
    ClothBody& body = bodies_[near.body];
    if (!(points.inverse_mass[i] > 0) || !may_support(points, body, i)) continue;
    const Vec4 end = points.free_end(i, dt);
    Touch t;
    if (!touch(points, near, end.head<3>(), kSupportReach * points.thickness[i], t) ||
        presses_from_above(points, body, i, t.normal))
      continue;
    const Vec4 normal = padded(t.normal), surface = padded(body.surface_motion(t.on_body, t.normal));
    const Real gap = std::max(t.gap - normal.dot(end - points.start[i] - surface), 0.0);
    const Support found{i,
                        normal,
                        gap,
                        surface,
                        std::sqrt(points.friction[i] * body.obstacle().friction),
                        body.is_dynamic() ? &body : nullptr,
                        t.on_body,
                        dt * dt * load_on(points, near)};
    if (points.supports.empty() || points.supports.back().point != i)
      points.supports.push_back(found);
    else if (found.gap < points.supports.back().gap)
      points.supports.back() = found;
    else
      continue;
    near.friction_applied = found.load > 0 && points.applies_friction[points.cloth[i]];
  }
}

void ClothContacts::solve(ClothPoints& points, Real dt, Real parts, std::vector<VelocityCut>& cuts) {
  std::fill(active_.begin(), active_.end(), 0);
  near_to_.assign(points.size(), nullptr);
  near_several_.assign(points.size(), 0);
  for (std::size_t k = 0; k < near_.size();) {
    touches_.clear();
    const uint32_t point = near_[k].point;
    near_to_[point] = &bodies_[near_[k].body];
    near_several_[point] = k + 1 < near_.size() && near_[k + 1].point == point;
    for (Touch t; k < near_.size() && near_[k].point == point; ++k) {
      const Real reach = bodies_[near_[k].body].loads.empty() ? kTouching : kUnderLoad - 1;
      if (touch(points, near_[k], points.at(point), reach * points.thickness[point], t))
        touches_.push_back(t);
    }
    const std::size_t count = touches_.size();
    if (count == 0) continue;
    active_[points.cloth[point]] += count;
    touched_[points.cloth[point]] = 1;
    // Contacts with fixed bodies come last. Errors at their surfaces are then smallest.
    std::stable_sort(touches_.begin(), touches_.end(), [](const Touch& a, const Touch& b) {
      return a.body->is_dynamic() > b.body->is_dynamic();
    });
    for (std::size_t a = 0; a < count; ++a) {
      const bool is_pinned = points.inverse_mass[point] == 0;
      bool supported = is_pinned, is_carried = false;
      for (std::size_t b = 0; b < count; ++b) {
        if (touches_[a].normal.dot(touches_[b].normal) > kFacing) continue;
        if (carries(touches_[a], touches_[b])) {
          is_carried = true;
          continue;
        }
        supported = true;
        if (!is_pinned && a < b && (touches_[a].body->is_dynamic() || touches_[b].body->is_dynamic()))
          pinch(touches_[a], touches_[b],
                std::sqrt(points.friction[point] * std::min(touches_[a].body->obstacle().friction,
                                                            touches_[b].body->obstacle().friction)));
      }
      // Where the contact solver carries the load, it also separates the bodies. At an edge of the body,
      // block() would push it away from points beside it.
      if (is_pinned && !is_carried) {
        touches_[a].near->pressed = 0;
        block(touches_[a], points.holder[point]);
        // The point has no mass that could take up the friction in press().
        const Real friction = std::sqrt(points.friction[point] * touches_[a].body->obstacle().friction);
        rub(*touches_[a].body, touches_[a].on_body, points.holder[point], touches_[a].on_body,
            touches_[a].normal, friction * touches_[a].near->pressed);
      }
      const bool is_moved = !(supported && touches_[a].body->is_dynamic()) &&
                            !presses_from_above(points, *touches_[a].body, point, touches_[a].normal);
      press(points, touches_[a], dt, parts, !is_moved, cuts);
    }
  }
}

/// Returns whether the contact solver carries the load between two bodies that press a point. The point then
/// only gets friction from the bodies, with its part of the load.
bool ClothContacts::carries(Touch& a, Touch& b) const {
  const ClothBody::Load* const load = a.body->load_against(*b.body);
  if (!load) return false;
  a.near->pressed =
      load->has_friction && load->points > 0 && !a.near->friction_applied ? load->impulse / load->points : 0;
  a.body->pinches = true;
  return true;
}

/// Solves the contact of two bodies that pinch a point: their velocities must not approach. The point also
/// transmits friction between them, which may be more than its own mass could cause.
void ClothContacts::pinch(Touch& a, Touch& b, Real friction) {
  const Vec3 n = (a.normal - b.normal).normalized();
  const Real mobility = a.body->mobility(a.on_body, n) + b.body->mobility(b.on_body, -n);
  if (!(mobility > 0)) return;
  const Real approach = n.dot(a.body->velocity(a.on_body) - b.body->velocity(b.on_body));
  const Real overlap = -(a.gap + b.gap);
  const Real impulse = (approach + kStabilization * overlap / h_) / mobility;
  a.body->pinches = b.body->pinches = true;
  if (!(impulse > 0)) return;
  a.body->apply_impulse(-impulse * n, a.on_body);
  b.body->apply_impulse(impulse * n, b.on_body);
  a.near->pressed += impulse;
  b.near->pressed += impulse;
  rub(*a.body, a.on_body, b.body, b.on_body, n, friction * impulse);
}

/// Solves the contact of a body with a point that is pinned to the world or to another body.
void ClothContacts::block(Touch& t, ClothBody* holder) {
  if (holder == t.body) return;
  const Real mobility =
      t.body->mobility(t.on_body, t.normal) + (holder ? holder->mobility(t.on_body, -t.normal) : 0);
  if (!(mobility > 0)) return;
  const Vec3 held = holder ? holder->velocity(t.on_body) : Vec3(Vec3::Zero());
  const Real approach = t.normal.dot(t.body->velocity(t.on_body) - held);
  const Real impulse = (approach - kStabilization * t.gap / h_) / mobility;
  if (!(impulse > 0)) return;
  t.body->apply_impulse(-impulse * t.normal, t.on_body);
  if (holder) holder->apply_impulse(impulse * t.normal, t.on_body);
  t.near->pressed = impulse;
}

std::vector<Vec3> ClothContacts::stop_bodies(const ClothPoints& points, std::span<const uint8_t> shortened,
                                             std::span<const Vec4> kick, std::span<const Real> recoil,
                                             std::span<const std::optional<Vec3>> whole_velocity,
                                             std::span<const BodyContact> triangles) {
  struct Stop {
    ClothBody* body;
    Vec3 normal, on_body;
    Real speed;  // velocity of the cloth at the contact, along the normal [m/s]
    Real depth;  // depth of the overlap, at most the thickness [m]
    uint32_t cloth;
    bool moves = true;  // whether the body moves in this sub-step; a body that holds cloth would move this
                        // cloth beyond its limits
    // 1 / number of the body's contacts, because all their impulses are found at the same time.
    Real fraction = 1;
    // Recoil of the cloth due to a unit impulse at each of its contacts, times the fraction [1/kg].
    Real recoil = 0;
    Real impulse = 0;  // impulse so far [N s]
    Real change = 0;   // change of the impulse in this sweep [N s]
  };
  std::vector<Stop> stops;
  struct OnBody {
    Real contacts = 0;
    bool holds_cloth = false;
  };
  std::map<const ClothBody*, OnBody> on_bodies;
  std::vector<Real> on_cloths(recoil.size(), 0);  // by cloth: number of contacts
  const auto add = [&](ClothBody& body, const Vec3& normal, const Vec3& on_body, const Vec3& velocity,
                       Real depth, uint32_t point) {
    const uint32_t cloth = points.cloth[point];
    Real speed = normal.dot(velocity);
    // The cloth stops the body as a whole. The body does not follow the vibration of the cloth's light
    // points, because it would gain energy.
    if (whole_velocity[cloth]) speed = std::max(speed, normal.dot(*whole_velocity[cloth]));
    stops.push_back({&body, normal, on_body, speed, std::min(depth, points.thickness[point]), cloth});
    const auto [at, is_new] = on_bodies.try_emplace(&body);
    ++at->second.contacts;
    ++on_cloths[cloth];
    if (is_new) at->second.holds_cloth = std::ranges::count(points.holder, &body) > 0;
  };
  const auto velocity = [&](uint32_t i, const ClothBody& body) {
    return Vec3((points.at(i) - points.start_at(i)) / body.duration() + kick[i].head<3>());
  };
  for (Near& near : near_) {
    ClothBody& body = bodies_[near.body];
    if (!body.is_dynamic() || !shortened[near.point]) continue;
    const Vec3 p = points.at(near.point), place = body.end().point_to_body(p);
    if (near.distance - (place - near.place).norm() >= near.least_distance) continue;
    const SurfaceDistance s = signed_distance(body.solid(), place);
    if (s.distance >= near.least_distance) continue;
    add(body, body.end().vector_to_world(s.normal), body.end().point_to_world(place - s.distance * s.normal),
        velocity(near.point, body), near.least_distance - s.distance, near.point);
  }
  for (const BodyContact& c : triangles) {
    if (c.gap >= 0 || std::ranges::none_of(c.points, [&](uint32_t i) { return shortened[i] != 0; })) continue;
    Vec3 mean = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) mean += c.weights[k] * velocity(c.points[k], *c.body);
    add(*c.body, c.normal, c.on_body, mean, -c.gap, c.points[0]);
  }
  for (Stop& s : stops) {
    s.fraction = 1 / on_bodies[s.body].contacts;
    s.recoil = s.fraction * on_cloths[s.cloth] * recoil[s.cloth];
    s.moves = !on_bodies[s.body].holds_cloth;
  }
  std::vector<Vec3> taken(recoil.size(), Vec3::Zero());
  // Projected Jacobi iteration: all contacts stop a body together. If they acted one after the other, the
  // first one would deflect the body. The change of the body's velocity moves the body already in this
  // sub-step. Otherwise a fast body would be behind the cloth at the end of the sub-step.
  for (int sweep = 0; sweep < kStopSweeps && !stops.empty(); ++sweep) {
    for (Stop& s : stops) {
      const Real speed = s.speed + recoil[s.cloth] * s.normal.dot(taken[s.cloth]);
      const Real approach = s.normal.dot(s.body->velocity(s.on_body)) - speed + kStabilization * s.depth / h_;
      const Real mobility = s.body->mobility(s.on_body, s.normal) + s.recoil;
      s.change = std::max(-s.impulse, s.fraction * approach / mobility);
    }
    for (Stop& s : stops) {
      s.impulse += s.change;
      const Vec3 impulse = -s.change * s.normal;
      s.moves ? s.body->apply_contact_impulse(impulse, s.on_body, 1)
              : s.body->apply_impulse(impulse, s.on_body);
      taken[s.cloth] += s.change * s.normal;
    }
  }
  return taken;
}

/// Moves a point out of one body. `supported`: whether another body holds the point from behind; pinch() or
/// the contact solver has then changed the velocities of the bodies.
void ClothContacts::press(ClothPoints& points, Touch& t, Real dt, Real parts, bool supported,
                          std::vector<VelocityCut>& cuts) {
  const uint32_t i = t.near->point;
  const Vec3& n = t.normal;
  ClothBody& body = *t.body;
  const Vec3 motion = points.at(i) - points.start_at(i) - body.surface_motion(t.on_body, n);
  body.touch((points.velocity[i].head<3>() - body.velocity(t.on_body)).norm());
  const Real w = points.inverse_mass[i];
  if (!(w > 0)) return;
  const Real already = std::min(t.gap - n.dot(motion), 0.0);  // gap at the start
  Real pressed = t.near->pressed / parts * dt;                // [kg m]
  Vec3 correction = Vec3::Zero(), recovery = Vec3::Zero();
  if (!supported) {
    const Real push = std::max(-t.gap, 0.0) / (w + body.mobility(t.on_body, n));
    pressed += push;
    correction = push * n;
    // The initial penetration is removed without a velocity of the point or the body.
    if (already < 0) {
      recovery = std::min(-already / w, push) * n;
      cuts.push_back({i, padded(w * recovery)});
    }
  }
  const Vec3 slip = motion - n.dot(motion) * n;
  const Real length = slip.norm();
  if (length > 0) {
    const Real friction = std::sqrt(points.friction[i] * body.obstacle().friction);
    const Vec3 along = slip / length;
    const Real stick = length / (w + body.mobility(t.on_body, -along));
    correction -= std::min(stick, friction * pressed) * along;
  }
  points.position[i] += padded(w * correction);
  body.apply_contact_impulse((recovery - correction) / dt, t.on_body, 1);
}

void ClothContacts::measure(const ClothPoints& points, std::span<Real> penetration) const {
  for (const Near& near : near_) {
    const ClothBody& body = bodies_[near.body];
    const Vec3 place = body.end().point_to_body(points.at(near.point));
    if (near.distance - (place - near.place).norm() >= 0) continue;
    Real& deepest = penetration[points.cloth[near.point]];
    deepest = std::max(deepest, -signed_distance(body.solid(), place).distance);
  }
}

}  // namespace offstage::sim
