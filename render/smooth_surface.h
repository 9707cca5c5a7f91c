#pragma once
/// Private: which surfaces show a mirror image of the scene. The passes of the shaders and the rays decide it
/// in the same way.

namespace offstage::render {

/// Dielectrics with a smaller roughness show a mirror image.
inline constexpr float kMirrorRoughness = 0.3f;

/// Whether a material shows a mirror image. Metals always do.
inline bool is_smooth(float roughness, float metallic) {
  return roughness < kMirrorRoughness || metallic > 0.5f;
}

}  // namespace offstage::render
