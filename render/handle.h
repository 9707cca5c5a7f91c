#pragma once
/// Handles of the objects of a stage. A handle is a typed index with the generation of its slot; it is null
/// by default. The stage detects stale handles.

#include <compare>
#include <cstdint>

namespace offstage::render {

template <class Tag>
struct Handle {
  uint32_t index = 0;
  uint32_t generation = 0;  ///< 0 is the null handle

  explicit operator bool() const { return generation != 0; }
  friend auto operator<=>(const Handle&, const Handle&) = default;
};

using MeshHandle = Handle<struct MeshTag>;
using MaterialHandle = Handle<struct MaterialTag>;
using InstanceHandle = Handle<struct InstanceTag>;
using PointsHandle = Handle<struct PointsTag>;
using LinesHandle = Handle<struct LinesTag>;
using ClothHandle = Handle<struct ClothTag>;

}  // namespace offstage::render
