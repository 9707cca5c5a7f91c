#pragma once
/// Opaque generational handles and the slot map that resolves them in O(1) (physics E1). A handle is passed
/// by value and is null by default. The handle of a removed object is detected, because the generation of its
/// slot has increased.

#include <cassert>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace offstage::sim {

/// Refers to one object of a World. `Tag` makes handles of different kinds of objects different types.
template <class Tag>
struct Handle {
  uint32_t index = 0;
  uint32_t generation = 0;  ///< 0 is the null handle

  explicit operator bool() const { return generation != 0; }
  friend auto operator<=>(const Handle&, const Handle&) = default;
};

/// Owns objects of type T, addressed by Handle<Tag>. Iteration is in slot order, so it is deterministic.
template <class T, class Tag>
class SlotMap {
 public:
  using HandleType = Handle<Tag>;

  HandleType insert(T value) {
    if (free_.empty()) {
      slots_.push_back({1, std::move(value)});
      return {static_cast<uint32_t>(slots_.size() - 1), 1};
    }
    const uint32_t index = free_.back();
    free_.pop_back();
    slots_[index].value = std::move(value);
    return {index, slots_[index].generation};
  }

  /// Removes the object; returns false if the handle is null or stale.
  bool erase(HandleType h) {
    if (!find(h)) return false;
    slots_[h.index].value.reset();
    ++slots_[h.index].generation;
    free_.push_back(h.index);
    return true;
  }

  /// The object, or nullptr if the handle is null or stale.
  T* find(HandleType h) {
    return h && h.index < slots_.size() && slots_[h.index].generation == h.generation && slots_[h.index].value
               ? &*slots_[h.index].value
               : nullptr;
  }
  const T* find(HandleType h) const { return const_cast<SlotMap*>(this)->find(h); }

  /// Returns the object; it must exist.
  T& operator[](HandleType h) {
    T* value = find(h);
    assert(value && "stale or null handle");
    return *value;
  }
  const T& operator[](HandleType h) const { return const_cast<SlotMap&>(*this)[h]; }

  /// The handle of the object in a slot; null if the slot is free.
  HandleType at_slot(uint32_t index) const {
    return index < slots_.size() && slots_[index].value ? HandleType{index, slots_[index].generation}
                                                        : HandleType{};
  }

  std::size_t size() const { return slots_.size() - free_.size(); }
  bool empty() const { return size() == 0; }
  /// Returns a number greater than the index of every handle.
  std::size_t slot_count() const { return slots_.size(); }

  /// Calls f(handle, object) for every live object in slot order.
  template <class F>
  void for_each(F&& f) {
    for (uint32_t i = 0; i < slots_.size(); ++i)
      if (slots_[i].value) f(HandleType{i, slots_[i].generation}, *slots_[i].value);
  }
  template <class F>
  void for_each(F&& f) const {
    for (uint32_t i = 0; i < slots_.size(); ++i)
      if (slots_[i].value) f(HandleType{i, slots_[i].generation}, std::as_const(*slots_[i].value));
  }

 private:
  struct Slot {
    uint32_t generation = 1;
    std::optional<T> value;
  };
  std::vector<Slot> slots_;
  std::vector<uint32_t> free_;
};

}  // namespace offstage::sim
