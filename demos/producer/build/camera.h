#pragma once
/// Computes the view of the scene's camera at any time.

#include <vector>

#include "producer/build/body_places.h"
#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/stage.h"

namespace offstage::producer {

class CameraRig {
 public:
  CameraRig(const Scene& scene, const ModelLibrary& models);
  render::Camera at(double time, const BodyPlaces& places, const std::vector<BodySample>& moving) const;

 private:
  const Scene& scene_;
  const ModelLibrary& models_;
  Eigen::AlignedBox3f fitted_;  ///< box of the bodies that are to fill the picture; empty if there are none
};

}  // namespace offstage::producer
