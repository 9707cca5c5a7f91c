#pragma once
/// Private: small pictures of puffs of smoke and flames. Each shows a lump of noise viewed along Z: its
/// opacity and the normal for lighting. They are generated once, and are the same in every run.

#include <array>
#include <cstdint>
#include <vector>

namespace offstage::render {

class PuffAtlas {
 public:
  enum class Kind { smoke, flame };
  static constexpr int kVariants = 8;  ///< number per kind

  /// One square picture with 4 bytes per texel: cover and the normal's x, y, z (as 127.5 n + 127.5). Rows run
  /// from the bottom up. The border has no cover.
  struct Level {
    const uint32_t* texels = nullptr;
    int size_px = 0;
  };

  PuffAtlas();
  /// Selects the smallest picture whose texels are no larger than the pixels of a puff `diameter_px` wide.
  Level level(Kind kind, int variant, float diameter_px) const;
  /// Returns the mean cover over the square for one kind of puff.
  float mean_cover(Kind kind) const { return mean_cover_[static_cast<std::size_t>(kind)]; }

 private:
  static constexpr int kFinest_px = 128, kLevels = 5;
  struct Picture {
    std::array<std::vector<uint32_t>, kLevels> levels;  ///< each level has half the size of the previous one
  };
  static Picture make_picture(Kind kind, uint32_t seed);

  std::array<Picture, 2 * kVariants> pictures_;
  std::array<float, 2> mean_cover_{};
};

}  // namespace offstage::render
