#include "sim/collision/broad_phase.h"

#include <algorithm>
#include <cassert>
#include <numeric>

#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {
namespace {

// Number of buckets or objects in one parallel job.
constexpr uint32_t kJob = 2048;

uint32_t jobs_of(std::size_t items) {
  return static_cast<uint32_t>((items + kJob - 1) / kJob);
}

IndexPair ordered(uint32_t a, uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

void BroadPhase::insert(uint32_t object, const Aabb& box, bool is_static) {
  assert(object < CellTable::kMaxObjects && !contains(object) && !box.isEmpty());
  if (object >= boxes_.size()) {
    boxes_.resize(object + 1);
    states_.resize(object + 1, 0);
  }
  boxes_[object] = box;
  unsettle(object);
  // A static object counts as at rest from the start; other objects are expected to move.
  states_[object] |= static_cast<uint8_t>(kLive | (is_static ? kStatic : kMoved));
  ++count_;
  count_diameter(object, 1);
}

void BroadPhase::move(uint32_t object, const Aabb& box) {
  assert(contains(object) && !box.isEmpty());
  count_diameter(object, -1);
  boxes_[object] = box;
  count_diameter(object, 1);
  unsettle(object);
  states_[object] |= kMoved;
}

void BroadPhase::remove(uint32_t object) {
  assert(contains(object));
  count_diameter(object, -1);
  --count_;
  states_[object] &= kUnsettled;
}

void BroadPhase::unsettle(uint32_t object) {
  if (states_[object] & kUnsettled) return;
  states_[object] |= kUnsettled;
  unsettled_.push_back(object);
}

void BroadPhase::count_diameter(uint32_t object, Real sign) {
  if (sizes_.kind != GridKind::uniform) return;
  const Real diameter = boxes_[object].sizes().maxCoeff();
  if (!(diameter < CellSizes::kMaxReach)) return;
  diameters_ += sign * diameter;
  bounded_ += sign;
}

/// Adapts the cell width to the mean diameter of the objects. There is a hysteresis, because a change moves
/// all objects to other cells.
void BroadPhase::fit_uniform_width() {
  constexpr Real kTolerance = 1.25;
  if (sizes_.kind != GridKind::uniform || !(bounded_ > 0 && diameters_ > 0)) return;
  const Real width = means_in_cell_ * diameters_ / bounded_;
  if (width < sizes_.uniform_width * kTolerance && width * kTolerance > sizes_.uniform_width) return;
  sizes_.uniform_width = width;
  for (uint32_t i = 0; i < states_.size(); ++i)
    if (contains(i)) unsettle(i);
}

std::span<const IndexPair> BroadPhase::pairs() {
  fit_uniform_width();
  std::erase_if(unsettled_, [&](uint32_t i) {
    if (!contains(i)) states_[i] = 0;
    return !contains(i);
  });
  work_ = {.entered = unsettled_.size()};
  block_count_ = 0;
  moving_.assign(sizes_, unsettled_, boxes_);
  work_.copies = resting_.enter_to_stay(moving_) + moving_.enter_to_pair(resting_);
  find_among_moving();
  find_with_resting();
  find_large();
  collect();
  settle_if_due();
  return pairs_;
}

/// Calls find(job, candidates) for each job, in parallel, and keeps the candidates whose boxes really
/// overlap. The results are stored by job, so they do not depend on the threads.
template <class Find>
void BroadPhase::search(std::size_t jobs, Find&& find) {
  const std::size_t first = block_count_;
  block_count_ += jobs;
  if (blocks_.size() < block_count_) blocks_.resize(block_count_);
  tbb::parallel_for(std::size_t{0}, jobs, [&](std::size_t job) {
    CandidatePairs& block = blocks_[first + job];
    block.meeting.clear();
    block.doubtful.clear();
    block.compared = 0;
    find(static_cast<uint32_t>(job), block);
    for (const IndexPair& p : block.doubtful)
      if (boxes_[p.a].intersects(boxes_[p.b])) block.meeting.push_back(p);
    std::erase_if(block.meeting, [&](const IndexPair& p) { return states_[p.a] & states_[p.b] & kStatic; });
  });
}

void BroadPhase::find_among_moving() {
  for (const CellTable& table : moving_.tables())
    search(jobs_of(table.bucket_count()), [&](uint32_t job, CandidatePairs& out) {
      table.find_pairs(job * kJob, std::min((job + 1) * kJob, table.bucket_count()), out);
    });
}

void BroadPhase::find_with_resting() {
  // The grid of resting objects still contains objects that have moved since it was built.
  const auto has_left = [&](const IndexPair& p) { return !is_settled(p.a) && !is_settled(p.b); };
  for (std::size_t level = 0; level < moving_.tables().size(); ++level) {
    const CellTable &moving = moving_.tables()[level], &resting = resting_.tables()[level];
    if (!moving.built() || !resting.built()) continue;
    search(jobs_of(moving.bucket_count()), [&](uint32_t job, CandidatePairs& out) {
      moving.find_pairs_with(resting, job * kJob, std::min((job + 1) * kJob, moving.bucket_count()), out);
      std::erase_if(out.meeting, has_left);
      std::erase_if(out.doubtful, has_left);
    });
  }
}

/// Finds the pairs of objects that are too large for cells. One object of each pair is unsettled.
void BroadPhase::find_large() {
  const auto size = static_cast<uint32_t>(states_.size());
  const auto is_large = [&](uint32_t i) { return sizes_.level(boxes_[i]) == CellSizes::kNone; };
  if (!moving_.large().empty())
    search(jobs_of(size), [&](uint32_t job, CandidatePairs& out) {
      for (uint32_t i = job * kJob; i < std::min((job + 1) * kJob, size); ++i)
        for (const uint32_t large : moving_.large())
          if (contains(i) && i != large && (i < large || is_settled(i) || !is_large(i)))
            out.doubtful.push_back(ordered(i, large));
    });
  const auto ranges = moving_.ranges();
  if (!resting_.large().empty())
    search(jobs_of(ranges.size()), [&](uint32_t job, CandidatePairs& out) {
      for (std::size_t i = job * kJob; i < std::min<std::size_t>((job + 1) * kJob, ranges.size()); ++i)
        for (const uint32_t large : resting_.large())
          if (is_settled(large)) out.doubtful.push_back(ordered(ranges[i].object, large));
    });
}

/// Sorts the new pairs by counting, and merges them with the stored pairs of settled objects.
void BroadPhase::collect() {
  const std::span<const CandidatePairs> blocks(blocks_.data(), block_count_);
  // The counts are stored two places further. Then begin_[a + 1] moves from the start of a's range to its end
  // while the pairs of a are placed.
  begin_.assign(states_.size() + 2, 0);
  for (const CandidatePairs& block : blocks) {
    work_.compared += block.compared;
    for (const IndexPair& p : block.meeting) ++begin_[p.a + 2];
  }
  std::inclusive_scan(begin_.begin(), begin_.end(), begin_.begin());
  found_.resize(begin_.back());
  for (const CandidatePairs& block : blocks)
    for (const IndexPair& p : block.meeting) found_[begin_[p.a + 1]++] = p;
  tbb::parallel_for(std::size_t{0}, states_.size(), [&](std::size_t a) {
    std::sort(found_.begin() + begin_[a], found_.begin() + begin_[a + 1]);
  });

  std::erase_if(pairs_, [&](const IndexPair& p) { return !is_settled(p.a) || !is_settled(p.b); });
  merged_.resize(pairs_.size() + found_.size());
  std::merge(pairs_.begin(), pairs_.end(), found_.begin(), found_.end(), merged_.begin());
  pairs_.swap(merged_);
}

void BroadPhase::settle_if_due() {
  const auto rests = [&](uint32_t i) { return !(states_[i] & kMoved); };
  const auto resting = static_cast<std::size_t>(std::count_if(unsettled_.begin(), unsettled_.end(), rests));
  in_vain_ += resting;
  // To settle an object costs about half as much as to insert and compare it once.
  const bool due = resting > 0 && 2 * in_vain_ >= count_;
  if (due) {
    std::erase_if(unsettled_, [&](uint32_t i) {
      if (rests(i)) states_[i] &= static_cast<uint8_t>(~kUnsettled);
      return rests(i);
    });
    std::vector<uint32_t> settled;
    for (uint32_t i = 0; i < states_.size(); ++i)
      if (is_settled(i)) settled.push_back(i);
    resting_.assign(sizes_, settled, boxes_);
    work_.settled = settled.size();
    in_vain_ = 0;
  }
  for (const uint32_t i : unsettled_) states_[i] &= static_cast<uint8_t>(~kMoved);
}

}  // namespace offstage::sim
