#include "render/paint_order.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

// A sort key contains, from the most significant bit: the number of layers in front, the depth, and the
// number of the point. The depth is not negative, so the order of its bits is the order of the depths.
constexpr int kNumberBits = 27, kOrderDepthBits = 31;
constexpr std::size_t kMostLayers = std::size_t{1} << (64 - kNumberBits - kOrderDepthBits);
constexpr uint32_t kMostPoints = uint32_t{1} << kNumberBits;

// Each kind of particle is drawn by another shader program, in runs of particles of one kind. If the number
// of alternating runs is larger than kMostRuns, neighbours in depth are merged to kSlices slices, in which
// the kinds are drawn one after the other.
constexpr std::size_t kMostRuns = 24, kSlices = 6;

uint64_t depth_and_layer(uint64_t key) {
  return key >> kNumberBits;
}
std::size_t layers_in_front(uint64_t key) {
  return static_cast<std::size_t>(key >> (kNumberBits + kOrderDepthBits));
}

// Sprites and flakes of equal depth are drawn by ascending number, so they are sorted by descending number.
bool is_quad(PaintOrder::Kind kind) {
  return kind == PaintOrder::Kind::sprites || kind == PaintOrder::Kind::flakes;
}

std::optional<PaintOrder::Kind> particle_kind(PointStyle style) {
  switch (style) {
    case PointStyle::smoke:
    case PointStyle::fire:
      return PaintOrder::Kind::puffs;
    case PointStyle::sprite:
      return PaintOrder::Kind::sprites;
    case PointStyle::flake:
      return PaintOrder::Kind::flakes;
    case PointStyle::streak:
      return PaintOrder::Kind::streaks;
    case PointStyle::sphere:
      break;
  }
  return std::nullopt;
}

}  // namespace

Region::Region(const Eigen::AlignedBox3f& box, const Eigen::Affine3f& world_from_box, bool round,
               const View& view)
    : box_from_world_(world_from_box.inverse()),
      box_(box),
      eye_(box_from_world_ * view.eye),
      center_(world_from_box * Vector3f(box.center())),
      world_eye_(view.eye),
      nearest_(std::numeric_limits<float>::infinity()),
      farthest_(-nearest_),
      depth_(view.depth_of(center_)),
      clip_from_world_(view.clip_from_world) {
  if (round) radius_ = 0.5f * box.sizes().x() * world_from_box.linear().col(0).norm();
  for (int k = 0; k < 8; ++k) {
    const Vector3f corner = world_from_box * box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(k));
    corners_[static_cast<std::size_t>(k)] = corner;
    world_box_.extend(corner);
    nearest_ = std::min(nearest_, view.depth_of(corner));
    farthest_ = std::max(farthest_, view.depth_of(corner));
  }
}

// If a plane separates a place from a body, the one on the eye's side of the plane can hide the other one,
// wherever they are in the picture.
bool Region::hides(const Vector3f& place, float depth) const {
  if (depth <= nearest_) return false;
  if (depth > farthest_) return true;
  if (radius_ > 0) {
    if ((place - center_).norm() < radius_) return true;
    // The circle in which the lines of sight touch the ball separates its front and its back.
    return (place - world_eye_).squaredNorm() > (center_ - world_eye_).squaredNorm() - radius_ * radius_;
  }
  const Vector3f p = box_from_world_ * place;
  bool inside = true;
  for (int k = 0; k < 3; ++k) {
    if (p[k] > box_.max()[k]) {
      if (eye_[k] <= box_.max()[k]) return true;
      inside = false;
    } else if (p[k] < box_.min()[k]) {
      if (eye_[k] >= box_.min()[k]) return true;
      inside = false;
    }
  }
  return inside && (surface_.empty() || surface_hides(place, depth));
}

bool Region::contains(const Vector3f& place) const {
  return box_.contains(box_from_world_ * place);
}

void Region::set_surface(const Eigen::AlignedBox2i& area_px, std::vector<float> depths,
                         const Vector2f& size_px) {
  surface_px_ = area_px;
  surface_ = std::move(depths);
  size_px_ = size_px;
}

bool Region::surface_hides(const Vector3f& place, float depth) const {
  const Vector4f clip = clip_from_world_ * place.homogeneous();
  if (clip.w() <= 0) return false;
  const Eigen::Array2f at = 0.5f * (clip.head<2>().array() / clip.w() + 1) * size_px_.array();
  const Eigen::Array2i first = surface_px_.min().array(), size = surface_px_.sizes().array();
  if (!(at > -1e6f).all() || !(at < 1e6f).all()) return false;
  const Eigen::Array2i pixel = (at.floor().cast<int>() - first).max(0).min(size - 1);
  return depth > surface_[static_cast<std::size_t>(pixel.y() * size.x() + pixel.x())];
}

Region::Side Region::side_of(const Region& other) const {
  Side side = Side::neither;
  std::array<Vector3f, 8> places;
  std::ranges::transform(other.corners_, places.begin(),
                         [&](const Vector3f& p) { return box_from_world_ * p; });
  const auto look = [&](bool apart, bool eye_with_this) {
    if (apart) side = eye_with_this ? Side::behind : side == Side::behind ? side : Side::before;
  };
  for (int k = 0; k < 3; ++k) {
    look(std::ranges::all_of(places, [&](const Vector3f& p) { return p[k] >= box_.max()[k]; }),
         eye_[k] <= box_.max()[k]);
    look(std::ranges::all_of(places, [&](const Vector3f& p) { return p[k] <= box_.min()[k]; }),
         eye_[k] >= box_.min()[k]);
  }
  return side;
}

bool Region::is_in_front_of(const Region& other) const {
  if (other.nearest_ >= farthest_) return true;
  if (nearest_ >= other.farthest_) return false;
  const Side by_this = side_of(other), by_other = other.side_of(*this);
  if (by_this == Side::behind || by_other == Side::before) return true;
  if (by_this == Side::before || by_other == Side::behind) return false;
  return depth_ < other.depth_;
}

std::vector<uint32_t> back_to_front(std::span<const Region> bodies,
                                    std::span<const Eigen::AlignedBox2i> areas_px) {
  const std::size_t n = bodies.size();
  std::vector<std::vector<uint32_t>> in_front(n);  // bodies in front of each body
  std::vector<uint32_t> behind(n, 0);              // number of bodies behind each that are not yet drawn
  for (uint32_t a = 0; a < n; ++a)
    for (uint32_t b = a + 1; b < n; ++b) {
      if (!areas_px[a].intersects(areas_px[b])) continue;
      const bool a_in_front = bodies[a].is_in_front_of(bodies[b]);
      in_front[a_in_front ? b : a].push_back(a_in_front ? a : b);
      ++behind[a_in_front ? a : b];
    }
  std::vector<uint32_t> by_depth(n), result;
  std::iota(by_depth.begin(), by_depth.end(), 0u);
  std::ranges::stable_sort(by_depth,
                           [&](uint32_t a, uint32_t b) { return bodies[a].depth() > bodies[b].depth(); });
  while (!by_depth.empty()) {
    auto next = std::ranges::find_if(by_depth, [&](uint32_t k) { return behind[k] == 0; });
    if (next == by_depth.end()) next = by_depth.begin();
    for (const uint32_t k : in_front[*next])
      if (behind[k] > 0) --behind[k];
    result.push_back(*next);
    by_depth.erase(next);
  }
  return result;
}

uint32_t PaintOrder::number(Kind kind, uint64_t key) const {
  const auto low = static_cast<uint32_t>(key & (kMostPoints - 1));
  return is_quad(kind) ? kMostPoints - 1 - low : low;
}

PaintOrder::Place PaintOrder::place(Kind kind, uint64_t key) const {
  const uint32_t n = number(kind, key);
  const std::vector<Source>& sources = sources_[index(kind)];
  auto source = sources.end() - 1;
  while (source->first > n) --source;
  return {source->set, n - source->first};
}

void PaintOrder::gather(std::span<const PointSet* const> sets, const View& view) {
  for (std::size_t k = 0; k < kKinds; ++k) {
    keys_[k].clear();
    sources_[k].clear();
    counts_[k] = 0;
  }
  for (const PointSet* set : sets) {
    const std::optional<Kind> kind = particle_kind(set->def.style);
    if (!kind) continue;
    uint32_t& next = counts_[index(*kind)];
    std::vector<uint64_t>& keys = keys_[index(*kind)];
    sources_[index(*kind)].push_back({set, next});
    for (std::size_t i = 0; i < set->points.size() && next < kMostPoints; ++i, ++next) {
      const Vector3f center = set->points[i].position.head<3>();
      const float depth = view.depth_of(center);
      // The margin accounts for thin particles, which are drawn one pixel wide.
      if (!view.sees(center, set->reach(i) + 0.01f * std::abs(depth))) continue;
      if (depth <= view.near_m && !is_quad(*kind)) continue;
      const uint32_t low = is_quad(*kind) ? kMostPoints - 1 - next : next;
      keys.push_back(uint64_t{std::bit_cast<uint32_t>(std::max(depth, 0.0f))} << kNumberBits | low);
    }
  }
}

// A particle is drawn before the farthest body that can hide it.
void PaintOrder::add_layers(std::span<const Region> bodies, const View& view) {
  const std::size_t layers = (bodies.size() + group_ - 1) / group_;
  for (std::size_t k = 0; k < kKinds; ++k) {
    const auto kind = static_cast<Kind>(k);
    constexpr std::size_t kBlock = 512;
    tbb::parallel_for(std::size_t{0}, (keys_[k].size() + kBlock - 1) / kBlock, [&](std::size_t block) {
      for (std::size_t i = block * kBlock; i < std::min(keys_[k].size(), (block + 1) * kBlock); ++i) {
        const Place at = place(kind, keys_[k][i]);
        const Vector3f center = at.set->points[at.index].position.head<3>();
        const float depth = view.depth_of(center);
        std::size_t body = 0;
        while (body < bodies.size() && !bodies[body].hides(center, depth)) ++body;
        const std::size_t in_front = body == bodies.size() ? 0 : layers - body / group_;
        keys_[k][i] |= uint64_t{in_front} << (kNumberBits + kOrderDepthBits);
      }
    });
  }
}

void PaintOrder::find_runs(std::size_t bodies) {
  struct Piece {
    std::size_t in_front;
    std::size_t kind;
    uint32_t first, last;
  };
  std::vector<Piece> pieces;  // nearest first
  std::array<uint32_t, kKinds> at{};
  for (;;) {
    std::size_t next = kKinds;
    for (std::size_t k = kKinds; k-- > 0;)
      if (at[k] < keys_[k].size() &&
          (next == kKinds || depth_and_layer(keys_[k][at[k]]) < depth_and_layer(keys_[next][at[next]])))
        next = k;
    if (next == kKinds) break;
    const std::size_t in_front = layers_in_front(keys_[next][at[next]]);
    if (pieces.empty() || pieces.back().kind != next || pieces.back().in_front != in_front)
      pieces.push_back({in_front, next, at[next], at[next]});
    pieces.back().last = ++at[next];
  }

  // Merges the pieces of a layer into slices, and the pieces of the same kind in a slice into a run.
  const std::size_t joined = pieces.size() > kMostRuns + bodies ? (pieces.size() + kSlices - 1) / kSlices : 1;
  std::vector<std::pair<std::size_t, Run>> runs;
  for (std::size_t p = 0; p < pieces.size();) {
    const std::size_t in_front = pieces[p].in_front;
    std::array<std::pair<uint32_t, uint32_t>, kKinds> ranges{};
    for (std::size_t n = 0; n < joined && p < pieces.size() && pieces[p].in_front == in_front; ++n, ++p) {
      auto& [first, last] = ranges[pieces[p].kind];
      if (first == last) first = pieces[p].first;
      last = pieces[p].last;
    }
    for (std::size_t k = kKinds; k-- > 0;)
      if (ranges[k].first < ranges[k].second)
        runs.push_back({in_front, {static_cast<Kind>(k), ranges[k].first, ranges[k].second}});
  }

  const std::size_t layers = (bodies + group_ - 1) / group_;
  runs_.clear();
  run_begins_.assign(1, 0);
  auto next = runs.rbegin();
  for (std::size_t body = 0; body <= bodies; ++body) {
    const bool starts_layer = body == bodies || body % group_ == 0;
    const std::size_t in_front = body == bodies ? 0 : layers - body / group_;
    for (; starts_layer && next != runs.rend() && next->first == in_front; ++next)
      runs_.push_back(next->second);
    run_begins_.push_back(static_cast<uint32_t>(runs_.size()));
  }
}

void PaintOrder::build(std::span<const PointSet* const> sets, std::span<const Region> bodies,
                       const View& view) {
  gather(sets, view);
  group_ = bodies.size() / (kMostLayers - 1) + 1;
  if (!bodies.empty()) add_layers(bodies, view);
  for (std::vector<uint64_t>& keys : keys_) std::sort(keys.begin(), keys.end());
  find_runs(bodies.size());
}

std::span<const PaintOrder::Run> PaintOrder::runs_before(std::size_t body) const {
  return std::span(runs_).subspan(run_begins_[body], run_begins_[body + 1] - run_begins_[body]);
}

Eigen::AlignedBox2i PaintOrder::area_px(const Run& run, const View& view, int width_px, int height_px) const {
  const Vector2f half(0.5f * static_cast<float>(width_px), 0.5f * static_cast<float>(height_px));
  Eigen::AlignedBox2f area;
  for (uint32_t k = run.first; k < run.last; ++k) {
    const Place at = place(run.kind, keys(run.kind)[k]);
    const Vector3f center = at.set->points[at.index].position.head<3>();
    const float depth = view.depth_of(center), reach = 1.5f * at.set->reach(at.index);
    if (depth - reach <= view.near_m) return {Eigen::Vector2i(0, 0), Eigen::Vector2i(width_px, height_px)};
    const Vector4f clip = view.clip_from_world * center.homogeneous();
    const Vector2f middle = (clip.head<2>().array() / clip.w() + 1) * half.array();
    const float reach_px = reach * half.y() / (view.tan_half.y() * (depth - reach)) + 2;
    area.extend(Vector2f(middle.array() - reach_px)).extend(Vector2f(middle.array() + reach_px));
  }
  const Eigen::Array2f most(static_cast<float>(width_px), static_cast<float>(height_px));
  return {area.min().array().max(0).min(most).floor().cast<int>().matrix(),
          area.max().array().max(0).min(most).ceil().cast<int>().matrix()};
}

}  // namespace offstage::render
