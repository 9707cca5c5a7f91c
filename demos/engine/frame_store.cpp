#include "engine/frame_store.h"

#include <algorithm>

namespace offstage::engine {

void FrameStore::put(const std::string& film, int frame, StoredFrame picture) {
  const std::lock_guard lock(mutex_);
  Film& entry = films_[film];
  entry.used = ++clock_;
  StoredFrame& place = entry.frames[{frame, picture.detail}];
  const std::size_t before = place.jpeg ? place.jpeg->size() : 0;
  place = std::move(picture);
  entry.bytes += place.jpeg->size() - before;
  bytes_ += place.jpeg->size() - before;
  make_room();
}

std::optional<StoredFrame> FrameStore::get(const std::string& film, int frame, Detail most) {
  const std::lock_guard lock(mutex_);
  const auto entry = films_.find(film);
  if (entry == films_.end()) return {};
  entry->second.used = ++clock_;
  for (int detail = static_cast<int>(most); detail >= 0; --detail)
    if (const auto it = entry->second.frames.find({frame, static_cast<Detail>(detail)});
        it != entry->second.frames.end())
      return it->second;
  return {};
}

bool FrameStore::has(const std::string& film, int frame, Detail detail) const {
  const std::lock_guard lock(mutex_);
  const auto entry = films_.find(film);
  return entry != films_.end() && entry->second.frames.contains({frame, detail});
}

std::vector<std::pair<int, int>> FrameStore::ranges(const std::string& film) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::pair<int, int>> ranges;
  const auto entry = films_.find(film);
  if (entry == films_.end()) return ranges;
  for (const auto& [place, picture] : entry->second.frames) {
    if (place.second != Detail::draft) continue;
    if (!ranges.empty() && ranges.back().second == place.first - 1)
      ++ranges.back().second;
    else
      ranges.emplace_back(place.first, place.first);
  }
  return ranges;
}

void FrameStore::protect(std::vector<std::string> films) {
  const std::lock_guard lock(mutex_);
  protected_ = std::move(films);
}

std::size_t FrameStore::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

void FrameStore::make_room() {
  while (bytes_ > most_bytes_ && !films_.empty()) {
    // The least recently used film loses its first frame. Protected films lose frames only when no other film
    // is left.
    const auto rank = [&](const auto& entry) {
      return std::pair(std::ranges::find(protected_, entry.first) != protected_.end(), entry.second.used);
    };
    const auto oldest = std::ranges::min_element(films_, {}, rank);
    Film& film = oldest->second;
    const auto frame = film.frames.begin();
    film.bytes -= frame->second.jpeg->size();
    bytes_ -= frame->second.jpeg->size();
    film.frames.erase(frame);
    if (film.frames.empty()) films_.erase(oldest);
  }
}

}  // namespace offstage::engine
