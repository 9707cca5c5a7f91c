#pragma once
/// Private: small pictures of puffs of smoke and flames. Each is a lump of noise looked through along Z, with
/// how much it covers and which way it faces the light; they are made once, the same in every run.

#include <array>
#include <cstdint>
#include <vector>

namespace offstage::render {

class PuffAtlas {
 public:
  enum class Kind { smoke, flame };
  static constexpr int kVariants = 8;  ///< of each kind

  /// One square picture: 4 bytes a texel, which are cover and the normal's x, y, z (as 127.5 n + 127.5), the
  /// rows from the bottom up. Nothing is covered along its border.
  struct Level {
    const uint32_t* texels = nullptr;
    int size_px = 0;
  };

  PuffAtlas();
  /// The smallest picture whose texels are no larger than the pixels of a puff `diameter_px` wide.
  Level level(Kind kind, int variant, float diameter_px) const;
  /// Mean cover over the square of a kind.
  float mean_cover(Kind kind) const { return mean_cover_[static_cast<std::size_t>(kind)]; }

 private:
  static constexpr int kFinest_px = 128, kLevels = 5;
  struct Picture {
    std::array<std::vector<uint32_t>, kLevels> levels;  ///< halved in size from one to the next
  };
  static Picture make_picture(Kind kind, uint32_t seed);

  std::array<Picture, 2 * kVariants> pictures_;
  std::array<float, 2> mean_cover_{};
};

}  // namespace offstage::render
