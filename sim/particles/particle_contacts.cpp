#include "sim/particles/particle_contacts.h"

#include <algorithm>
#include <limits>

#include <oneapi/tbb/parallel_for.h>

#include "sim/collision/distance.h"
#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

constexpr std::size_t kContactChunk = ParticleSearch::kChunk;
/// Contacts belong to the same surface if the cosine of the angle between their normals is greater than this.
constexpr Real kSameSurface = 0.95;
/// Depth below a contact at which the surface is looked up [m], and the least cosine between its normals on a
/// face.
constexpr Real kInside = 1e-8, kSameFace = 1 - 1e-14;
/// Greatest step between flush obstacles [m], and as a fraction of the particle's diameter, as for bodies
/// (sim/contact/internal_edges.h).
constexpr Real kFlushStep = 1e-4, kFlushStepFraction = 1e-3;

/// Calls f(distance, normal) for points of a solid's surface within `reach` [m] of p, in the solid's frame. A
/// mesh gives the nearest point of each triangle; other solids give only their nearest point.
template <class F>
void for_each_surface(const Solid& solid, const Vec3& p, Real reach, F&& f) {
  if (!solid.mesh) {
    const SurfaceDistance s = signed_distance(solid, p);
    if (s.distance < reach) f(s.distance, s.normal);
    return;
  }
  const CollisionMesh& m = *solid.mesh;
  const Aabb box(p - Vec3::Constant(reach), p + Vec3::Constant(reach));
  m.tree.overlapping(box, [&](uint32_t face) {
    const Triangle& t = m.mesh.triangles[face];
    const auto& v = m.mesh.vertices;
    const Vec3 away = p - closest_on_triangle(p, v[t[0]], v[t[1]], v[t[2]]).point;
    const Real distance = away.norm();
    if (distance > 0 && distance < reach) f(distance, Vec3(away / distance));
  });
}

/// Returns the part of an impulse that a contact can transmit with its current normal: without tension, and
/// with friction within its limit.
Vec3 admissible(const Vec3& impulse, const Vec3& normal, Real friction) {
  const Real pressing = impulse.dot(normal);
  if (!(pressing > 0)) return Vec3::Zero();
  const Vec3 across = impulse - pressing * normal;
  const Real size = across.norm(), limit = friction * pressing;
  return pressing * normal + (size > limit ? Real(limit / size) : 1) * across;
}

/// Whether a contact is on a face, and not on an edge or a corner with a normal between those of faces: its
/// normal is that of the nearest surface inside the obstacle, too. The point there is a little nearer to the
/// obstacle's middle, because a contact at the border of a face has the normal of the face. Contacts with
/// meshes do not count.
bool is_on_face(const ParticleContacts::Touch& touch, Real h) {
  if (touch.obstacle->solid.mesh) return false;
  const Pose pose = touch.obstacle->at(touch.meets ? touch.time / h : 1);
  const Vec3 normal = pose.vector_to_body(touch.normal), place = pose.point_to_body(touch.place);
  const Vec3 to_middle = normal.dot(place) * normal - place;
  const Vec3 inside = place - kInside * normal + 2 * kInside * to_middle.stableNormalized();
  return signed_distance(touch.obstacle->solid, inside).normal.dot(normal) > kSameFace;
}

/// Removes the contacts with edges that do not rise above a face of another obstacle that the particle
/// touches: edges between flush obstacles stop no particle.
void remove_internal_edges(std::vector<ParticleContacts::Touch>& touches, Real radius, Real h) {
  using Touch = ParticleContacts::Touch;
  const auto is_of_first = [&](const Touch& touch) { return touch.obstacle == touches.front().obstacle; };
  if (std::ranges::all_of(touches, is_of_first)) return;
  for (Touch& touch : touches) touch.on_face = is_on_face(touch, h);
  const Real flush = std::min(kFlushStep, kFlushStepFraction * 2 * radius);
  const auto is_internal = [&](const Touch& edge) {
    if (edge.on_face || edge.obstacle->solid.mesh) return false;
    return std::ranges::any_of(touches, [&](const Touch& face) {
      return face.on_face && face.obstacle != edge.obstacle &&
             (edge.place - face.place).dot(face.normal) <= flush;
    });
  };
  // Only contacts that are no faces are erased, so the faces are the same for all of them.
  for (std::size_t k = touches.size(); k-- > 0;)
    if (is_internal(touches[k])) touches.erase(touches.begin() + static_cast<std::ptrdiff_t>(k));
}

}  // namespace

std::size_t ParticleContacts::chunk_count() const {
  return (particles_.size() + kContactChunk - 1) / kContactChunk;
}

/// Calls f(chunk, first, last) in parallel for consecutive ranges of particles.
template <class F>
void ParticleContacts::for_each_chunk(F&& f) const {
  tbb::parallel_for(std::size_t{0}, chunk_count(), [&](std::size_t c) {
    f(c, static_cast<uint32_t>(c * kContactChunk),
      static_cast<uint32_t>(std::min(particles_.size(), (c + 1) * kContactChunk)));
  });
}

void ParticleContacts::find() {
  found_.resize(chunk_count());
  for_each_chunk([&](std::size_t c, uint32_t begin, uint32_t end) {
    Found& found = found_[c];
    found.pairs.clear();
    found.surfaces.clear();
    found.reactions.clear();
    found.strikes.clear();
    NearObstacles near(step_->fixed, step_->moving);
    for (uint32_t i = begin; i < end; ++i) {
      // These indices are relative to the start of the chunk until collect().
      pair_begin_[i] = static_cast<uint32_t>(found.pairs.size());
      surface_begin_[i] = static_cast<uint32_t>(found.surfaces.size());
      find_pairs(i, found);
      find_surfaces(i, near, found);
    }
  });
  collect();
}

void ParticleContacts::find_pairs(uint32_t i, Found& found) const {
  const CollidingParticle& a = particles_[i];
  const Real h = step_->h;
  for (const uint32_t j : search_->partners(i)) {
    const CollidingParticle& b = particles_[j];
    Pair pair;
    Vec3 normal;
    Real target, time;
    const Vec3 u = a.velocity - b.velocity;
    if (const auto met = meeting(a, b, h)) {
      const Real speed = -u.dot(met->normal);
      pair.is_impact = is_impact(speed, greater_acceleration(a, b), *step_);
      // A contact that is not an impact acts during the whole sub-step. Its target closes the gap at the end.
      const Real from = std::max(a.from, b.from);
      target = pair.is_impact ? pair_restitution(a, b) * speed : -speed * (met->time - from) / h;
      normal = met->normal;
      time = pair.is_impact ? met->time : from;
    } else {
      // The normal is taken at half of the motion; there it does not reverse if the particles penetrate each
      // other. For fast particles that pass each other, it is taken at the end.
      const Real from = std::max(a.from, b.from), reach = a.radius + b.radius;
      const Vec3 d = a.at(h) - b.at(h), displacement = (h - from) * u;
      const Vec3 middle = displacement.squaredNorm() < reach * reach / 64 ? Vec3(d - displacement / 2) : d;
      const Real size = middle.norm();
      if (!(size > 0)) continue;
      normal = middle / size;
      const Real gap = d.dot(normal) - reach;
      if (gap > kMargin / 2 * reach) continue;
      pair.is_impact = false;
      target = std::min(0.0, u.dot(normal) - gap / h);
      time = std::max(a.from, b.from);
    }
    pair.a = i & kIndex;
    pair.b = j & kIndex;
    pair.normal_single = normal.cast<float>();
    pair.mass = static_cast<float>(a.mass * b.mass / (a.mass + b.mass));
    pair.sliding_mass = a.turning > 0 || b.turning > 0 ? static_cast<float>(mass_across(a, b)) : pair.mass;
    pair.target = static_cast<float>(target);
    pair.time = static_cast<float>(time);
    pair.friction = static_cast<float>(pair_friction(a.friction, b.friction));
    const uint32_t apart = order_.layer[i] - order_.layer[j];
    const auto layers = static_cast<uint32_t>(order_.layer_begin.size() - 1);
    pair.is_far = !(apart + 1 <= 2 || apart == layers - 1 || apart + layers == 1);
    recall(pair);
    found.pairs.push_back(pair);
  }
}

void ParticleContacts::find_surfaces(uint32_t i, NearObstacles& near, Found& found) const {
  const CollidingParticle& g = particles_[i];
  if (!g.hits_bodies) return;
  const Real h = step_->h, margin = kMargin * g.radius;
  const Vec3 end = g.at(h);
  near.find(g.position, end, g.radius + margin);
  std::vector<Touch>& touches = found.touches;
  touches.clear();
  for (const Obstacle* o : near.all()) {
    if (o->body == impacts_->struck_body(i)) continue;
    Vec3 later = Vec3::Zero();
    if (g.from < h) {
      const ObstacleHit hit = NearObstacles::hit(*o, SpherePath(g.position, end, g.from / h), g.radius,
                                                 std::numeric_limits<Real>::infinity());
      later = hit.obstacle && hits_later(i, hit) ? hit.normal : Vec3(Vec3::Zero());
      if (hit.obstacle && later.isZero())
        touches.push_back({o, hit.normal, hit.position - g.radius * hit.normal, 0, hit.fraction * h, true});
    }
    for_each_surface(
        o->solid, o->end.point_to_body(end), g.radius + margin, [&](Real distance, const Vec3& local) {
          const Vec3 normal = o->end.vector_to_world(local);
          if (later.dot(normal) > kSameSurface) return;
          touches.push_back({o, normal, end - distance * normal, distance - g.radius, g.from, false});
        });
  }
  remove_internal_edges(touches, g.radius, h);
  const std::size_t first = found.surfaces.size();
  for (const Touch& t : touches) add_surface(i, *t.obstacle, t.normal, t.gap, t.time, t.meets, first, found);
}

/// Whether the particle reaches a surface in an impact, but in the next sub-step only. Contacts are found on
/// straight paths with the velocities at the end; the particle may not come that far.
bool ParticleContacts::hits_later(uint32_t i, const ObstacleHit& hit) const {
  const CollidingParticle& g = particles_[i];
  const Vec3 surface = hit.obstacle->velocity_at(hit.position, hit.fraction);
  if (!is_impact((surface - g.velocity).dot(hit.normal), greater_acceleration(g, *hit.obstacle, step_->h),
                 *step_))
    return false;
  const Real rest = (1 - hit.fraction) * step_->h;
  return (free_end_[i] - hit.position - rest * surface).dot(hit.normal) > 0;
}

/// Adds the contact of particle i with a surface that it hits (`meets`), or whose distance at the end is
/// `gap` [m]. Each surface is added only once. `first`: index of the first contact that was found for this
/// particle.
void ParticleContacts::add_surface(uint32_t i, const Obstacle& o, const Vec3& normal, Real gap, Real time,
                                   bool meets, std::size_t first, Found& found) const {
  for (std::size_t k = first; k < found.surfaces.size(); ++k)
    if (found.surfaces[k].obstacle == &o && found.surfaces[k].normal().dot(normal) > kSameSurface) return;
  const CollidingParticle& g = particles_[i];
  Surface s;
  s.particle = i;
  s.obstacle = &o;
  s.body = o.body;
  const Vec3 velocity = o.velocity_at(g.at(step_->h) - g.radius * normal, 1);
  s.normal_single = normal.cast<float>();
  s.velocity = velocity + o.conveying_velocity(normal, 1);
  s.friction_axis = o.friction_axis_on(normal, 1);
  s.friction = static_cast<float>(pair_friction(g.friction, o.friction));
  s.mass = static_cast<float>(g.mass);
  s.sliding_mass = static_cast<float>(g.mass / (1 + g.turning));
  const Real speed = (velocity - g.velocity).dot(normal);
  s.is_impact = meets && is_impact(speed, greater_acceleration(g, o, step_->h), *step_);
  Real target = meets ? -speed * (time - g.from) / step_->h : std::min(0.0, -speed - gap / step_->h);
  s.time = static_cast<float>(s.is_impact ? time : g.from);
  if (s.is_impact) target = speed * std::max(g.restitution, o.restitution);
  s.target = static_cast<float>(target);
  recall(s);
  found.surfaces.push_back(s);
}

/// Sets the initial guess of a pair's impulse to its impulse of the previous sub-step.
void ParticleContacts::recall(Pair& pair) const {
  pair.impulse_single.setZero();
  const uint32_t a = order_.before[pair.a], b = order_.before[pair.b];
  if (a == kNone || b == kNone || pair.is_impact) return;
  const auto look = [&](uint32_t from, uint32_t to, Real sign) {
    for (uint32_t k = pair_begin_before_[from]; k < pair_begin_before_[from + 1]; ++k) {
      if (pairs_before_[k].b != to) continue;
      const Vec3 impulse = sign * step_->h / h_before_ * pairs_before_[k].impulse();
      pair.impulse_single = admissible(impulse, pair.normal(), pair.friction).cast<float>();
      return true;
    }
    return false;
  };
  if (!look(a, b, 1)) look(b, a, -1);
}

void ParticleContacts::recall(Surface& s) const {
  s.impulse_single.setZero();
  const uint32_t i = order_.before[s.particle];
  if (i == kNone || s.is_impact) return;
  for (uint32_t k = surface_begin_before_[i]; k < surface_begin_before_[i + 1]; ++k) {
    const Surface& old = surfaces_before_[k];
    if (old.body != s.body || old.normal().dot(s.normal()) < kSameSurface) continue;
    s.impulse_single = admissible(step_->h / h_before_ * old.impulse(), s.normal(), s.friction).cast<float>();
    return;
  }
}

CollidingParticle::Carrier ParticleContacts::carrier(uint32_t particle) const {
  CollidingParticle::Carrier carrier;
  for (uint32_t k = surface_begin_[particle]; k < surface_begin_[particle + 1]; ++k) {
    const Surface& s = surfaces_[k];
    if (s.pushed == kNone || !s.acts()) continue;
    const Vec3 change =
        motion_[particle].inverse_mass() * s.impulse() - PushedBody::at(pushed_[s.pushed].gained, s.arm);
    if (const Real speed = change.dot(s.normal()); speed > carrier.speed) carrier = {s.body, speed};
  }
  return carrier;
}

/// Merges the results of the chunks.
void ParticleContacts::collect() {
  std::size_t pairs = 0, surfaces = 0;
  std::vector<std::pair<std::size_t, std::size_t>> offset;
  for (const Found& found : found_) {
    offset.emplace_back(pairs, surfaces);
    pairs += found.pairs.size();
    surfaces += found.surfaces.size();
  }
  pairs_.resize(pairs);
  surfaces_.resize(surfaces);
  pair_begin_.back() = static_cast<uint32_t>(pairs);
  surface_begin_.back() = static_cast<uint32_t>(surfaces);
  for_each_chunk([&](std::size_t c, uint32_t begin, uint32_t end) {
    const auto [first_pair, first_surface] = offset[c];
    std::copy(found_[c].pairs.begin(), found_[c].pairs.end(),
              pairs_.begin() + static_cast<std::ptrdiff_t>(first_pair));
    std::copy(found_[c].surfaces.begin(), found_[c].surfaces.end(),
              surfaces_.begin() + static_cast<std::ptrdiff_t>(first_surface));
    for (uint32_t i = begin; i < end; ++i) {
      pair_begin_[i] += static_cast<uint32_t>(first_pair);
      surface_begin_[i] += static_cast<uint32_t>(first_surface);
    }
  });
  far_.clear();
  for (std::size_t k = 0; k < pairs; ++k)
    if (pairs_[k].is_far) far_.push_back(static_cast<uint32_t>(k));
}

/// Finds the dynamic bodies that particles touch, and the effective masses of the contacts with them.
void ParticleContacts::find_pushed_bodies() {
  pushed_.clear();
  pushed_index_.clear();
  on_pushed_.clear();
  std::vector<Vec6> direction;  // by pushed body: sum of unit impulses of the particles
  for (uint32_t k = 0; k < surfaces_.size(); ++k) {
    Surface& s = surfaces_[k];
    if (!s.obstacle->is_dynamic()) continue;
    const auto [found, is_new] = pushed_index_.try_emplace(s.body, static_cast<uint32_t>(pushed_.size()));
    if (is_new) {
      pushed_.push_back({s.obstacle});
      direction.push_back(Vec6::Zero());
    }
    s.pushed = found->second;
    const CollidingParticle& g = particles_[s.particle];
    s.arm = g.at(s.time) - g.radius * s.normal() - s.obstacle->centre_at(s.time / step_->h);
    direction[s.pushed] += stacked(-s.normal(), -s.arm.cross(s.normal()));
    on_pushed_.push_back(k);
  }
  for (std::size_t b = 0; b < pushed_.size(); ++b) {
    PushedBody& body = pushed_[b];
    body.mobility = step_->impulses.mobility(*body.obstacle, direction[b]);
    body.gained = -body.mobility * stacked(step_->impulses.expected(body.obstacle->body));
  }
  for (const uint32_t k : on_pushed_) {
    Surface& s = surfaces_[k];
    const CollidingParticle& g = particles_[s.particle];
    const auto E = point_velocity(s.arm);
    const Mat3 K = E * pushed_[s.pushed].mobility * E.transpose();
    const Real along = s.normal().dot(K * s.normal());
    // The trace bounds the mobilities along the surface in all directions.
    s.mass = static_cast<float>(1 / (1 / g.mass + along));
    s.sliding_mass = static_cast<float>(1 / ((1 + g.turning) / g.mass + K.trace() - along));
  }
}

void ParticleContacts::solve(std::span<CollidingParticle> particles, const Order& order,
                             const ParticleSearch& search, const ParticleImpacts& impacts,
                             const ParticleStep& step, uint32_t lcp_cluster, std::span<Vec3> end,
                             std::span<uint8_t> touched, std::vector<Reaction>& reactions,
                             std::vector<ParticleStrike>& strikes) {
  particles_ = particles;
  order_ = order;
  search_ = &search;
  impacts_ = &impacts;
  step_ = &step;
  free_end_ = end;
  std::swap(pairs_, pairs_before_);
  std::swap(surfaces_, surfaces_before_);
  std::swap(pair_begin_, pair_begin_before_);
  std::swap(surface_begin_, surface_begin_before_);
  pair_begin_.resize(particles.size() + 1);
  surface_begin_.resize(particles.size() + 1);
  find();
  solved_.clear();
  lcp_work_ = {};
  find_pushed_bodies();
  if (lcp_cluster > 0) solve_clusters(lcp_cluster);
  relax();
  displace(end, touched);
  displace_bodies();
  follow_carriers(end);
  push_apart(end);
  stop_passing(end);
  keep_outside(end, reactions, strikes);
  h_before_ = step.h;
}

}  // namespace offstage::sim
