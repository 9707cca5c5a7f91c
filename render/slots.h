#pragma once
/// Private: the table behind a handle type. A slot's generation changes when its value is removed, so that
/// stale handles are detected.

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "render/handle.h"

namespace offstage::render {

template <class T, class Tag>
class Slots {
 public:
  explicit Slots(const char* noun) : noun_(noun) {}

  Handle<Tag> add(T value) {
    uint32_t index;
    if (free_.empty()) {
      index = static_cast<uint32_t>(slots_.size());
      slots_.emplace_back();
    } else {
      index = free_.back();
      free_.pop_back();
    }
    slots_[index].value.emplace(std::move(value));
    return {index, slots_[index].generation};
  }

  /// Returns the value. Throws std::logic_error if the handle is null or stale.
  T& operator[](Handle<Tag> handle) {
    if (handle.index >= slots_.size() || slots_[handle.index].generation != handle.generation ||
        !slots_[handle.index].value) {
      throw std::logic_error("the handle of a " + std::string(noun_) +
                             (handle ? " is stale: it was removed" : " is null"));
    }
    return *slots_[handle.index].value;
  }

  void remove(Handle<Tag> handle) {
    (*this)[handle];
    Slot& slot = slots_[handle.index];
    slot.value.reset();
    ++slot.generation;
    free_.push_back(handle.index);
  }

  /// Calls `visit(value)` in order of index, so that the drawing order is reproducible.
  template <class Visit>
  void for_each(Visit&& visit) {
    for (Slot& slot : slots_) {
      if (slot.value) visit(*slot.value);
    }
  }

 private:
  struct Slot {
    std::optional<T> value;
    uint32_t generation = 1;
  };
  const char* noun_;
  std::vector<Slot> slots_;
  std::vector<uint32_t> free_;
};

}  // namespace offstage::render
