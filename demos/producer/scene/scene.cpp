#include "producer/scene/scene.h"

#include <cmath>
#include <numbers>

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

sim::DecompositionSettings settings_of(const std::optional<MeshDecomposition>& decomposition) {
  sim::DecompositionSettings settings;
  if (!decomposition) return settings;
  settings.method = decomposition->method;
  settings.max_error = decomposition->max_error;
  if (decomposition->max_parts)
    settings.max_parts = settings.most_parts = static_cast<uint32_t>(*decomposition->max_parts);
  settings.min_dihedral = decomposition->min_angle_deg * std::numbers::pi / 180;
  settings.min_distance = decomposition->min_distance;
  return settings;
}

int Scene::frame_count() const {
  return static_cast<int>(std::lround(output.duration * output.fps.per_second()));
}

}  // namespace offstage::producer
