#include "render/trace/embree.h"

#include "render/error.h"

namespace offstage::render {

void DeleteRayTree::operator()(RTCSceneTy* tree) const {
  rtcReleaseScene(tree);
}

namespace embree {

RTCDevice device() {
  static const RTCDevice made = [] {
    RTCDevice result = rtcNewDevice("isa=avx2");
    if (result == nullptr)
      throw UnavailableError("Embree cannot be used: this processor lacks the AVX2 instructions");
    return result;
  }();
  return made;
}

RayTree make_tree(RTCBuildQuality quality) {
  RayTree tree(rtcNewScene(device()));
  rtcSetSceneFlags(tree.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(tree.get(), quality);
  return tree;
}

RTCGeometry make_geometry(RTCGeometryType type) {
  RTCGeometry geometry = rtcNewGeometry(device(), type);
  rtcSetGeometryMask(geometry, ~0u);
  return geometry;
}

unsigned attach(RTCScene tree, RTCGeometry geometry) {
  rtcCommitGeometry(geometry);
  const unsigned id = rtcAttachGeometry(tree, geometry);
  rtcReleaseGeometry(geometry);
  return id;
}

void attach(RTCScene tree, RTCGeometry geometry, unsigned number) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(tree, geometry, number);
  rtcReleaseGeometry(geometry);
}

void set_ray(RTCRay& ray, const Vector3f& from, const Vector3f& direction, float length, unsigned mask) {
  ray.org_x = from.x();
  ray.org_y = from.y();
  ray.org_z = from.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tnear = 0;
  ray.tfar = length;
  ray.time = 0;
  ray.mask = mask;
  ray.id = 0;
  ray.flags = 0;
}

}  // namespace embree
}  // namespace offstage::render
