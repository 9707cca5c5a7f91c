#pragma once
/// Private: a bounding volume hierarchy of Embree, without Embree's headers.

#include <memory>

struct RTCSceneTy;
struct RTCGeometryTy;
struct RTCRayHit;

namespace offstage::render {

struct DeleteRayTree {
  void operator()(RTCSceneTy* tree) const;
};
using RayTree = std::unique_ptr<RTCSceneTy, DeleteRayTree>;

}  // namespace offstage::render
