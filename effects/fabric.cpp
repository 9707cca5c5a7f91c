#include "effects/fabric.h"

#include <algorithm>
#include <array>
#include <iterator>

namespace offstage::effects {
namespace {

// Areal densities and flexural rigidities are measured values (docs/scene-guide.md names the sources). The
// stiffness along the threads is a tenth to a hundredth of the real one: at these loads the strain is already
// far below a per cent, and a higher stiffness would only need more steps. The low shear stiffness makes
// woven cloth drape in folds. drag - lift is the friction of both sides of a plate in a turbulent boundary
// layer, 2 * 0.074 Re^(-1/5) or 0.01 at 1 m and 10 m/s, doubled for rough cloth. With a larger value, a flag
// would be stretched so much that it hardly flutters.
const std::array<FabricPreset, 6> kPresets = {{
    {"silk",
     "light and flowing, many small folds",
     {.areal_density = 0.06,
      .stretch = 600,
      .shear = 12,
      .bend = 4e-6,
      .damping = 0.02,
      .friction = 0.25,
      .self_friction = 0.2,
      .thickness = 0.004,
      .drag = 1,
      .lift = 0.98}},
    {"cotton",
     "sheets, shirts, flags",
     {.areal_density = 0.15,
      .stretch = 1500,
      .shear = 40,
      .bend = 2e-5,
      .damping = 0.04,
      .friction = 0.45,
      .self_friction = 0.35,
      .thickness = 0.005,
      .drag = 1,
      .lift = 0.98}},
    {"denim",
     "heavy and stiff, few large folds",
     {.areal_density = 0.4,
      .stretch = 4000,
      .shear = 250,
      .bend = 8e-5,
      .damping = 0.06,
      .friction = 0.55,
      .self_friction = 0.45,
      .thickness = 0.006,
      .drag = 1,
      .lift = 0.98}},
    {"leather",
     "for garments: soft and heavy, few large folds",
     {.areal_density = 0.6,
      .stretch = 9000,
      .shear = 2500,
      .bend = 1.2e-4,
      .damping = 0.12,
      .friction = 0.6,
      .self_friction = 0.5,
      .thickness = 0.007,
      .drag = 1,
      .lift = 0.98}},
    {"rubber",
     "a sheet that stretches and springs back",
     {.areal_density = 1.2,
      .stretch = 900,
      .shear = 450,
      .bend = 3e-4,
      .damping = 0.03,
      .friction = 0.9,
      .self_friction = 0.9,
      .thickness = 0.006,
      .drag = 1,
      .lift = 0.98,
      .max_stretch = 2}},
    // A latex balloon of 30 cm weighs 3 g. The skin of this preset has no stress at a diameter of 20 cm.
    // Stretched by lambda = 1.5, it has the tension 1.5 stretch (lambda - 1) / lambda, which equals p R / 2
    // for a pressure p of 2.5 kPa. The drag equals the drag of a sphere: its coefficient is 4 (drag - lift) +
    // 4/3 lift = 0.47 (docs/scene-guide.md).
    {"balloon",
     "the skin of a balloon of 20 cm that is blown up to 30 cm",
     {.areal_density = 0.024,
      .stretch = 375,
      .shear = 100,
      .bend = 1e-6,
      .damping = 0.1,
      .friction = 0.7,
      .self_friction = 0.7,
      .thickness = 0.003,
      .drag = 0.3525,
      .lift = 0.3525,
      .max_stretch = 0}},
}};

}  // namespace

std::span<const FabricPreset> fabric_presets() {
  return kPresets;
}

const FabricPreset* find_fabric(const std::string& name) {
  const auto at =
      std::find_if(kPresets.begin(), kPresets.end(), [&](const FabricPreset& p) { return p.name == name; });
  return at == kPresets.end() ? nullptr : &*at;
}

}  // namespace offstage::effects
