#pragma once
/// Private: Embree 3 (Debian 12) or 4 (Debian 13, Ubuntu 24.04) behind the same calls.

#include <array>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "render/mesh.h"
#include "render/trace/ray_tree.h"

namespace offstage::render::embree {

/// Returns the device of the process. The instruction set is fixed, because others round hit distances
/// differently.
RTCDevice device();
/// Returns an empty hierarchy.
RayTree make_tree(RTCBuildQuality quality);
/// Returns a geometry that belongs to all groups of objects. (By default, a geometry belongs to all groups in
/// Embree 3, but only to the first one in Embree 4.)
RTCGeometry make_geometry(RTCGeometryType type);
/// Attaches a geometry, gives up its reference, and returns its number, which may be chosen.
unsigned attach(RTCScene tree, RTCGeometry geometry);
void attach(RTCScene tree, RTCGeometry geometry, unsigned number);
/// Sets a ray from `from`. `direction` is a unit vector; `length` [m]; `mask`: the groups of objects that the
/// ray meets.
void set_ray(RTCRay& ray, const Vector3f& from, const Vector3f& direction, float length, unsigned mask);

using Valid = std::array<int, 8>;  ///< -1: the ray is traced, 0: it is not; must be aligned to 32 bytes

#if RTC_VERSION_MAJOR >= 4
inline void intersect(RTCScene scene, RTCRayHit& ray) {
  rtcIntersect1(scene, &ray);
}
inline void occluded(RTCScene scene, RTCRay& ray) {
  rtcOccluded1(scene, &ray);
}
/// Tests whether eight coherent rays hit anything.
inline void occluded(RTCScene scene, const Valid& valid, RTCRay8& rays) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid.data(), scene, &rays, &arguments);
}
#else
inline void intersect(RTCScene scene, RTCRayHit& ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
}
inline void occluded(RTCScene scene, RTCRay& ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
}
inline void occluded(RTCScene scene, const Valid& valid, RTCRay8& rays) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid.data(), scene, &context, &rays);
}
#endif

}  // namespace offstage::render::embree
