#include "producer/scene/scene.h"

#include <cmath>

namespace offstage::producer {

int subframes(Quality quality) {
  switch (quality) {
    case Quality::draft:
      return 1;
    case Quality::preview:
      return 4;
    case Quality::final:
      return 16;
  }
  return 1;
}

int Scene::frame_count() const {
  return static_cast<int>(std::lround(output.duration * output.fps.per_second()));
}

}  // namespace offstage::producer
