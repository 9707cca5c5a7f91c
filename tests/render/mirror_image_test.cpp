// Objects in a flat mirror against the same objects seen directly. Rays shade the mirror image; shaders shade
// the direct picture.

#include <cmath>
#include <functional>

#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

constexpr int kWidth_px = 96, kHeight_px = 64, kSubFrames = 8;

Eigen::Affine3f place_at(const Vector3f& position, float turn_deg = 0) {
  return Eigen::Translation3f(position) * Eigen::AngleAxisf(turn_deg * 0.0174533f, Vector3f::UnitY());
}

/// Returns a square in the plane z = 0 whose front faces -z. Seen from there, u increases to the right and v
/// downwards.
Mesh make_square(float half) {
  Mesh mesh;
  mesh.positions = {{half, -half, 0}, {-half, -half, 0}, {-half, half, 0}, {half, half, 0}};
  mesh.normals.assign(4, -Vector3f::UnitZ());
  mesh.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  return mesh;
}

/// Returns an image of n x n pixels. `at`: RGBA in [0, 1] at (u, v).
Image make_image(int n, const std::function<Vector4f(float, float)>& at) {
  Image image{n, n, {}};
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const Vector4f c = at((static_cast<float>(x) + 0.5f) / static_cast<float>(n),
                            (static_cast<float>(y) + 0.5f) / static_cast<float>(n));
      for (int k = 0; k < 4; ++k)
        image.rgba.push_back(static_cast<uint8_t>(std::lround(255 * std::clamp(c[k], 0.0f, 1.0f))));
    }
  return image;
}

/// Bumps, as a normal map.
const Image& bumps() {
  static const Image image = make_image(64, [](float u, float v) {
    const Vector3f n = Vector3f(0.6f * std::sin(12.566f * u), 0.6f * std::sin(12.566f * v), 1).normalized();
    return Vector4f(0.5f + 0.5f * n.x(), 0.5f + 0.5f * n.y(), 0.5f + 0.5f * n.z(), 1);
  });
  return image;
}
const Image& board() {
  static const Image image = make_image(64, [](float u, float v) {
    const bool odd = (static_cast<int>(4 * u) + static_cast<int>(4 * v)) % 2 != 0;
    return odd ? Vector4f(0.9f, 0.9f, 0.9f, 1) : Vector4f(0.1f, 0.2f, 0.3f, 1);
  });
  return image;
}
/// Different values in each quarter, for occlusion (R), roughness (G) and metallic (B).
const Image& quarters() {
  static const Image image = make_image(64, [](float u, float v) {
    return Vector4f(v < 0.5f ? 1.0f : 0.2f, u < 0.5f ? 0.4f : 0.9f, v < 0.5f ? 0.0f : 1.0f, 1);
  });
  return image;
}

using Fill = std::function<void(SmallStage&)>;

/// An object that is shown directly and in a mirror.
struct Shown {
  Mesh mesh = make_square(1);
  Material material = {.color = {0.6f, 0.5f, 0.4f, 1}, .roughness = 0.6f};
  std::vector<Image> textures = {};
  Eigen::Affine3f world_from_mesh = place_at({0, 0, 3});

  void add_to(SmallStage& s) const {
    const InstanceHandle it =
        s.stage.add_instance(s.stage.add_mesh(mesh), s.stage.add_material(material, textures));
    s.stage.set_transform(it, world_from_mesh);
  }
};

/// A mirror in the plane z = 0, of which only the front is visible, and objects about 3 m before it. One
/// picture is taken before the mirror. The other one is taken from the place of its virtual eye behind the
/// mirror.
struct MirrorScene {
  Sun sun{.direction = Vector3f(-0.45f, 0.4f, -0.6f).normalized(), .color = {1, 0.95f, 0.9f}, .intensity = 2};
  Environment sky;
  std::vector<Lamp> lamps = {};

  HdrImage draw(const Fill& fill, bool in_mirror) const {
    SmallStage s(kWidth_px, kHeight_px);
    s.stage.set_sun(sun);
    s.stage.set_environment(sky);
    s.stage.set_lamps(lamps);
    const InstanceHandle mirror =
        s.add(make_square(1), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0});
    s.stage.set_transform(mirror, place_at({0, 0, 0}, 180));
    fill(s);
    const Vector3f flip(1, 1, in_mirror ? 1 : -1), eye(0.3f, 0.2f, 1.5f), target(0, 0, -3);
    s.stage.set_camera({.eye = eye.cwiseProduct(flip), .target = target.cwiseProduct(flip), .fov_deg = 22});
    HdrImage sum;
    for (int i = 0; i < kSubFrames; ++i) s.stage.draw(sample_offsets(i, kSubFrames), sum);
    return sum;
  }
  /// Returns the root mean square of the difference between both pictures, after averaging over 3 x 3 pixels,
  /// relative to that of the direct picture.
  float difference(const Fill& fill) const {
    const HdrImage mirror = draw(fill, true), direct = draw(fill, false);
    float error2 = 0, sum2 = 0;
    for (int y = 6; y < kHeight_px - 6; ++y)
      for (int x = 26; x < kWidth_px - 26; ++x) {
        Vector3f seen = Vector3f::Zero(), expected = seen;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            seen += pixel(mirror, x + dx, y + dy).head<3>();
            expected += pixel(direct, kWidth_px - 1 - x - dx, y + dy).head<3>();
          }
        error2 += (seen - expected).squaredNorm();
        sum2 += expected.squaredNorm();
      }
    EXPECT_GT(sum2, 1);  // something is visible
    return std::sqrt(error2 / sum2);
  }
};

MirrorScene daylight() {
  return {};
}
MirrorScene lamplight() {
  MirrorScene night;
  night.sun.intensity = 0;
  night.sky.intensity = 0;
  night.lamps = {Lamp{.position = {-1.5f, 1, 0.5f}, .intensity = {6, 6, 6}, .radius = 0.1f}};
  return night;
}

/// Expects equal pictures of a changed object in the light of sun and sky, and in that of a lamp.
void expect_equal(const char* name, const std::function<void(Shown&)>& change, float tolerance = 0.04f) {
  Shown shown;
  change(shown);
  const Fill fill = [&](SmallStage& s) { shown.add_to(s); };
  EXPECT_LT(daylight().difference(fill), tolerance) << name << " in daylight";
  EXPECT_LT(lamplight().difference(fill), tolerance) << name << " in lamplight";
}

const std::vector<Vector2f> kOtherCoordinates = {{0, 0.5f}, {0.5f, 0.5f}, {0.5f, 0}, {0, 0}};

// The differences were 0.33 to 0.36 when rays did not see normal maps.
TEST(MirrorImage, ShowsNormalMaps) {
  const auto add_bumps = [](Shown& s) {
    s.textures = {bumps()};
    s.material.normal_texture.image = 0;
  };
  expect_equal("normal map", add_bumps);
  expect_equal("given tangents", [&](Shown& s) {
    add_bumps(s);
    s.mesh.tangents.assign(4, Vector4f(0, 1, 0, -1));
  });
  expect_equal("moved and flattened map", [&](Shown& s) {
    add_bumps(s);
    s.material.normal_scale = 0.5f;
    s.material.normal_texture.rows = {Vector3f(1.5f, 0.5f, 0.1f), Vector3f(-0.5f, 1.5f, 0.2f)};
  });
  expect_equal("second coordinates", [&](Shown& s) {
    add_bumps(s);
    s.mesh.second_uvs = kOtherCoordinates;
    s.material.normal_texture.uv_set = 1;
  });
  expect_equal("back of a sheet", [&](Shown& s) {
    add_bumps(s);
    s.material.two_sided = true;
    s.world_from_mesh = place_at({0, 0, 3}, 180);
  });
  for (const bool tangents : {false, true})
    expect_equal("mirroring transform", [&](Shown& s) {
      add_bumps(s);
      if (tangents) s.mesh.tangents.assign(4, Vector4f(0, 1, 0, 1));
      s.world_from_mesh = place_at({0, 0, 3}) * Eigen::Scaling(-1.0f, 1.0f, 1.0f);
    });
}

TEST(MirrorImage, ShowsTexturesOfTheMaterial) {
  expect_equal("second coordinates", [](Shown& s) {
    s.textures = {board()};
    s.material.base_color_texture.image = 0;
    s.material.base_color_texture.uv_set = 1;
    s.mesh.second_uvs = kOtherCoordinates;
  });
  expect_equal("squares as texels", [](Shown& s) {
    s.textures = {make_image(4, [](float u, float v) {
      return (u < 0.5f) != (v < 0.5f) ? Vector4f(1, 1, 1, 1) : Vector4f(0, 0, 1, 1);
    })};
    s.material.base_color_texture.image = 0;
    s.material.base_color_texture.nearest = true;
  });
  expect_equal("emission", [](Shown& s) {
    s.textures = {board()};
    s.material.emission = {1, 0.5f, 0.2f};
    s.material.emission_texture.image = 0;
    s.material.emission_texture.uv_set = 1;
    s.mesh.second_uvs = kOtherCoordinates;
  });
  expect_equal("metallic and roughness", [](Shown& s) {
    s.textures = {quarters()};
    s.material.metallic_roughness_texture.image = 0;
    s.material.metallic = s.material.roughness = 1;
  });
  expect_equal("occlusion", [](Shown& s) {
    s.textures = {quarters()};
    s.material.occlusion_texture.image = 0;
  });
  expect_equal("specular colour", [](Shown& s) {
    s.textures = {board()};
    s.material.color = {0.1f, 0.1f, 0.1f, 1};
    s.material.specular = {0.3f, 0.2f, 0.1f};
    s.material.specular_texture.image = 0;
  });
  expect_equal("glossiness", [](Shown& s) {
    s.material.glossiness = 0.6f;
    s.material.specular = {0.2f, 0.2f, 0.2f};
  });
  expect_equal("transmission", [](Shown& s) {
    s.textures = {quarters()};
    s.material.transmission = 1;
    s.material.transmission_texture.image = 0;
    s.material.thin = true;
  });
}

TEST(MirrorImage, ShowsReflectionsAndLayers) {
  expect_equal(
      "black",
      [](Shown& s) {
        s.material.color = {0, 0, 0, 1};
      },
      0.06f);
  for (const float metallic : {0.4f, 1.0f})
    for (const float roughness : {0.5f, 0.8f})
      expect_equal("rough metal", [&](Shown& s) {
        s.material.metallic = metallic;
        s.material.roughness = roughness;
      });
  expect_equal(
      "varnish, which mirrors the mirror", [](Shown& s) { s.material.roughness = 0.2f; }, 0.015f);
  for (const float turn_deg : {0.0f, 60.0f}) {
    expect_equal(
        "clearcoat",
        [&](Shown& s) {
          s.material.clearcoat = 1;
          s.material.clearcoat_roughness = 0.1f;
          s.world_from_mesh = place_at({0, 0, 3}, turn_deg);
        },
        0.06f);
    // The coat has no relief.
    expect_equal(
        "clearcoat over a normal map",
        [&](Shown& s) {
          s.textures = {bumps()};
          s.material.normal_texture.image = 0;
          s.material.clearcoat = 1;
          s.material.clearcoat_roughness = 0.1f;
          s.world_from_mesh = place_at({0, 0, 3}, turn_deg);
        },
        0.06f);
    expect_equal("sheen", [&](Shown& s) {
      s.material.color = {0.1f, 0.1f, 0.1f, 1};
      s.material.sheen_color = {1, 0.2f, 0.2f};
      s.world_from_mesh = place_at({0, 0, 3}, turn_deg);
    });
  }
  expect_equal("box of translucent faces", [](Shown& s) {
    s.material.color.w() = 0.4f;
    s.mesh = make_box({2, 2, 0.2f});
  });
  MirrorScene fog = daylight();
  fog.sky.fog = 0.15f;
  EXPECT_LT(fog.difference([](SmallStage& s) { Shown().add_to(s); }), 0.01f);
}

// The area of the pattern over which a pixel of the mirror image is the mean must be that of the direct
// picture, which is at a distance from the eye, and not from the mirror. The differences were up to 0.05 in
// daylight when it was not, and up to 0.08 in lamplight when only the mirror showed the relief.
TEST(MirrorImage, ShowsThePatternsOfSurfaces) {
  for (const Pattern pattern :
       {Pattern::brick, Pattern::sand, Pattern::lawn, Pattern::planks, Pattern::water}) {
    const Fill fill = [&](SmallStage& s) {
      Shown shown;
      shown.material.pattern = pattern;
      shown.material.pattern_scale = 0.5f;
      shown.material.pattern_color = {0.2f, 0.3f, 0.1f};
      shown.add_to(s);
    };
    EXPECT_LT(daylight().difference(fill), 0.012f) << static_cast<int>(pattern);
    EXPECT_LT(lamplight().difference(fill), 0.025f) << static_cast<int>(pattern);
  }
}

/// Adds a cloth of coarse threads.
void add_cloth(SmallStage& s, Weave weave, bool back) {
  const Mesh square = make_square(1);
  ClothDef cloth{.triangles = square.indices, .uvs = square.uvs};
  if (back) cloth.triangles = {0, 2, 1, 0, 3, 2};
  for (Vector2f& uv : cloth.uvs) uv *= 2;  // [m]
  const Fabric fabric{.weave = weave, .thread = 0.2f, .relief = 1, .sheen = 0, .translucency = 0};
  const ClothHandle it = s.stage.add_cloth(
      cloth, s.stage.add_material({.color = {0.6f, 0.3f, 0.2f, 1}, .roughness = 0.7f, .fabric = fabric}));
  std::vector<Vector3f> positions;
  for (const Vector3f& p : square.positions) positions.push_back(place_at({0, 0, 3}, 40) * p);
  s.stage.set_cloth(it, positions);
}

TEST(MirrorImage, ShowsTheThreadsOfCloth) {
  for (const Weave weave : {Weave::plain, Weave::twill, Weave::satin})
    for (const bool back : {false, true}) {
      const Fill fill = [&](SmallStage& s) { add_cloth(s, weave, back); };
      EXPECT_LT(daylight().difference(fill), 0.02f) << static_cast<int>(weave) << back;
      EXPECT_LT(lamplight().difference(fill), 0.02f) << static_cast<int>(weave) << back;
    }
}

/// Returns by how much a pattern or a weave differs in the light of a distant lamp from that of the sun from
/// the same direction: the root mean square of the difference of pictures with equal means, relative to the
/// sun's picture.
float difference_of_distant_lamp(const Fill& fill) {
  MirrorScene by_sun = lamplight(), by_lamp = by_sun;
  by_lamp.lamps = {Lamp{.position = Vector3f(0, 0, -3) + 60 * by_sun.sun.direction,
                        .intensity = Vector3f::Constant(6000),
                        .radius = 0.2f}};
  by_sun.lamps.clear();
  by_sun.sun = {.direction = by_sun.sun.direction, .color = {1, 1, 1}, .intensity = 1, .size_deg = 0.4f};
  const auto values = [&](const MirrorScene& scene) {
    const HdrImage picture = scene.draw(fill, false);
    Eigen::VectorXf v((kWidth_px - 52) * (kHeight_px - 12));
    for (int y = 6, i = 0; y < kHeight_px - 6; ++y)
      for (int x = 26; x < kWidth_px - 26; ++x) v[i++] = pixel(picture, x, y).y();
    EXPECT_GT(v.mean(), 0.01f);
    return Eigen::VectorXf(v / v.mean());
  };
  const Eigen::VectorXf expected = values(by_sun);
  return (values(by_lamp) - expected).norm() / expected.norm();
}

// Without relief in the light of lamps, the differences were 0.085, 0.070 and 0.19. The highlights of rough
// surfaces have no relief.
TEST(LampRelief, OfADistantLampIsThatOfTheSun) {
  for (const Pattern pattern : {Pattern::sand, Pattern::lawn}) {
    const Fill fill = [&](SmallStage& s) {
      Shown shown;
      shown.material.roughness = 0.9f;
      shown.material.pattern = pattern;
      shown.material.pattern_scale = 0.5f;
      shown.add_to(s);
    };
    EXPECT_LT(difference_of_distant_lamp(fill), 0.025f) << static_cast<int>(pattern);
  }
  EXPECT_LT(difference_of_distant_lamp([&](SmallStage& s) { add_cloth(s, Weave::twill, false); }), 0.06f);
}

TEST(MirrorImage, ShowsBothSidesOfCloth) {
  const auto expect_equal_cloth = [](const char* name, const Fabric& fabric, bool back, float turn_deg) {
    const Fill fill = [&](SmallStage& s) {
      const Mesh square = make_square(1);
      const ClothHandle it = s.stage.add_cloth(
          {.triangles = back ? std::vector<uint32_t>{0, 2, 1, 0, 3, 2} : square.indices, .uvs = square.uvs},
          s.stage.add_material({.color = {0.6f, 0.3f, 0.2f, 1}, .roughness = 0.7f, .fabric = fabric}));
      std::vector<Vector3f> positions;
      for (const Vector3f& p : square.positions) positions.push_back(place_at({0, 0, 3}, turn_deg) * p);
      s.stage.set_cloth(it, positions);
    };
    EXPECT_LT(daylight().difference(fill), 0.04f) << name;
    EXPECT_LT(lamplight().difference(fill), 0.06f) << name;
  };
  const Fabric bare{.weave = Weave::none, .sheen = 0, .translucency = 0};
  Fabric lined = bare, velvet = bare, thin = bare;
  lined.back_color = Vector3f(0.1f, 0.2f, 0.6f);
  expect_equal_cloth("lining, front", lined, false, 0);
  expect_equal_cloth("lining, back", lined, true, 0);
  velvet.sheen = 1;
  expect_equal_cloth("sheen", velvet, false, 55);
  thin.translucency = 0.8f;
  expect_equal_cloth("translucent", thin, false, 0);
}

/// Returns the light of the middle of a picture.
Vector3f light_of_middle(const HdrImage& picture) {
  Vector3f sum = Vector3f::Zero();
  for (int y = 6; y < kHeight_px - 6; ++y)
    for (int x = 26; x < kWidth_px - 26; ++x) sum += pixel(picture, x, y).head<3>();
  return sum;
}

// Mirror images show particles as discs, so only the mean is the same. Smoke in lamplight had 0.6 of its
// light when the direction of the light on its surface was neglected.
TEST(MirrorImage, ShowsTheLightOfParticles) {
  MirrorScene by_day = daylight();
  by_day.sky.intensity = 0;
  for (const PointStyle style : {PointStyle::smoke, PointStyle::sprite, PointStyle::flake})
    for (const MirrorScene& scene : {by_day, lamplight()}) {
      const Fill fill = [&](SmallStage& s) {
        std::vector<Point> points;
        for (int i = 0; i < 64; ++i)
          points.push_back({.position = {-0.9f + 0.25f * static_cast<float>(i % 8),
                                         -0.9f + 0.25f * static_cast<float>(i / 8), 3},
                            .velocity = Vector3f::Zero(),
                            .radius = 0.3f,
                            .color = {0.8f, 0.7f, 0.6f, 0.2f},
                            .id = static_cast<uint64_t>(i)});
        s.stage.set_points(s.stage.add_points({.style = style}), points);
      };
      const Vector3f direct = light_of_middle(scene.draw(fill, false));
      const Vector3f ratio = light_of_middle(scene.draw(fill, true)).cwiseQuotient(direct);
      EXPECT_GT(direct.minCoeff(), 1);
      EXPECT_LT((ratio - Vector3f::Ones()).cwiseAbs().maxCoeff(), 0.1f)
          << ratio.transpose() << ", style " << static_cast<int>(style) << ", lamps " << scene.lamps.size();
    }
}

// The length of a streak is that of its motion, with its rounded ends; a slow one is a dot.
TEST(MirrorImage, ShowsStreaksWithTheirLength) {
  MirrorScene dark = daylight();
  dark.sky.intensity = 0;
  for (const float taper : {0.0f, 1.0f})
    for (const float length : {0.0f, 0.3f, 0.7f, 1.0f, 1.6f}) {
      const Fill fill = [&](SmallStage& s) {
        Point streak{.position = {0, 0, 3},
                     .velocity = {0.6f * length, 0.8f * length, 0},
                     .radius = 0.2f,
                     .color = {1, 1, 1, 1},
                     .id = 1};
        s.stage.set_points(s.stage.add_points({.style = PointStyle::streak,
                                               .lit = false,
                                               .softness = 0.2f,
                                               .stretch_s = 1,
                                               .taper = taper}),
                           std::array{streak});
      };
      const float direct = light_of_middle(dark.draw(fill, false)).x();
      EXPECT_NEAR(light_of_middle(dark.draw(fill, true)).x() / direct, 1, 0.04f)
          << "length " << length << ", taper " << taper;
    }
}

// A wet surface mirrors the scene, and so does its mirror image. Its ripples move.
TEST(MirrorImage, ShowsWater) {
  for (const float turn_deg : {0.0f, 50.0f}) {
    const Fill fill = [&](SmallStage& s) {
      s.stage.set_time(3);
      Shown water;
      water.material = {.color = {0.1f, 0.3f, 0.35f, 1},
                        .roughness = 0.03f,
                        .pattern = Pattern::water,
                        .pattern_color = {0.15f, 0.4f, 0.45f},
                        .pattern_scale = 0.6f};
      water.world_from_mesh = place_at({0, 0, 3}, turn_deg);
      water.add_to(s);
      Shown beside;
      beside.material.emission = {0.5f, 0.1f, 0.1f};
      beside.world_from_mesh = place_at({-2, 0, 2}, -90);
      beside.add_to(s);
    };
    EXPECT_LT(daylight().difference(fill), 0.04f) << turn_deg;
  }
}

// Pictures do not show the back of a sheet with one side, neither directly nor in mirrors.
TEST(MirrorImage, HidesTheBacksOfSheetsWithOneSide) {
  for (const bool two_sided : {false, true}) {
    const Fill fill = [&](SmallStage& s) {
      Shown board_behind;
      board_behind.world_from_mesh = place_at({0, 0, 4});
      board_behind.material.emission = {0, 1, 0};
      board_behind.add_to(s);
      Shown sheet;
      sheet.material.color = {0.9f, 0.1f, 0.1f, 1};
      sheet.material.two_sided = two_sided;
      sheet.world_from_mesh = place_at({0, 0, 3}, 180);
      sheet.add_to(s);
    };
    const Vector4f seen = center_pixel(daylight().draw(fill, true));
    EXPECT_EQ(seen.y() > seen.x(), !two_sided);
    EXPECT_LT(daylight().difference(fill), 0.03f);
  }
}

// A sheet takes light away from a floor on whichever side its front is.
TEST(MirrorImage, SheetsWithOneSideHaveShadowsOnBothSides) {
  std::array<float, 3> light{};
  for (const int front : {-1, 0, 1}) {
    SmallStage s(kWidth_px, kHeight_px);
    s.stage.set_sun({.direction = {0, 1, 0}, .intensity = 1});
    s.add(make_ground(20), {.color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1});
    if (front != 0) {
      const InstanceHandle sheet = s.add(make_square(1), {.color = {0, 0, 0, 1}, .roughness = 1});
      s.stage.set_transform(sheet,
                            Eigen::Translation3f(0, 0.5f, 0) *
                                Eigen::AngleAxisf(1.5707963f * static_cast<float>(front), Vector3f::UnitX()));
    }
    s.stage.set_camera({.eye = {0, 0.3f, 3}, .target = {0, 0, 0}, .fov_deg = 20});
    HdrImage sum;
    for (int i = 0; i < kSubFrames; ++i) s.stage.draw(sample_offsets(i, kSubFrames), sum);
    light[static_cast<std::size_t>(front + 1)] = center_pixel(sum).y();
  }
  EXPECT_LT(light[0], 0.4f * light[1]);
  EXPECT_NEAR(light[2] / light[0], 1, 0.05f);
}

float fresnel_of_pane(float cosine) {
  return 0.04f + 0.96f * std::pow(1 - cosine, 5.0f);
}

/// A plate that mirrors sun or lamp to the eye, and a pane before it through which the light comes, too.
struct PaneScene {
  static constexpr float kTilt_deg = 25;
  Vector3f plate = {0, 0, 3}, eye = {1, 0, -4}, to_eye, to_light;

  PaneScene() {
    const Vector3f normal =
        -(Eigen::AngleAxisf(kTilt_deg * 0.0174533f, Vector3f::UnitY()) * Vector3f::UnitZ());
    to_eye = (eye - plate).normalized();
    to_light = 2 * normal.dot(to_eye) * normal - to_eye;
  }
  /// Returns the light of the middle of the plate. `thickness`: of the pane [m]; 0: a thin sheet; negative:
  /// none.
  Vector3f light(const Material& of_plate, bool by_lamp, float thickness, const Vector3f& tint) const {
    SmallStage s(kWidth_px, kHeight_px);
    s.stage.set_environment({.intensity = 0, .visible = false});
    s.stage.set_sun({.direction = to_light, .color = {1, 1, 1}, .intensity = by_lamp ? 0.0f : 1.0f});
    if (by_lamp)
      s.stage.set_lamps(std::array{
          Lamp{.position = plate + 12 * to_light, .intensity = Vector3f::Constant(100), .radius = 0.2f}});
    Shown object{.mesh = make_square(2), .material = of_plate, .world_from_mesh = place_at(plate, kTilt_deg)};
    object.add_to(s);
    if (thickness >= 0) {
      Material glass{.color = {tint.x(), tint.y(), tint.z(), 1}, .roughness = 0, .transmission = 1};
      glass.thin = thickness == 0;
      s.add(thickness > 0 ? make_box({16, 16, thickness}) : make_square(8), glass, {0, 0, 1});
    }
    s.stage.set_camera({.eye = eye, .target = plate, .fov_deg = 20});
    HdrImage picture;
    for (int i = 0; i < kSubFrames; ++i) s.stage.draw(sample_offsets(i, kSubFrames), picture);
    Vector3f sum = Vector3f::Zero();
    for (int dy = -4; dy <= 4; ++dy)
      for (int dx = -4; dx <= 4; ++dx)
        sum += pixel(picture, kWidth_px / 2 + dx, kHeight_px / 2 + dy).head<3>();
    return sum;
  }
};

// The light passes the pane on its way to the plate and on its way back. The pane has two surfaces; light
// that the second one mirrors is added to the refracted light on the way to the eye.
TEST(HighlightBehindGlass, LosesOnlyTheLightThatThePaneTakes) {
  const PaneScene scene;
  const float there = std::pow(1 - fresnel_of_pane(-scene.to_light.z()), 2.0f);
  const float back = 1 - fresnel_of_pane(-scene.to_eye.z());
  for (const Material& material : {Material{.color = {0.8f, 0.8f, 0.8f, 1}, .metallic = 1, .roughness = 0.4f},
                                   Material{.color = {0, 0, 0, 1}, .roughness = 0.4f},
                                   Material{.color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1}})
    for (const auto& [by_lamp, tint] :
         {std::pair(false, Vector3f(0.7f, 0.7f, 0.7f)), std::pair(true, Vector3f(0.7f, 0.7f, 0.7f)),
          std::pair(false, Vector3f(0.9f, 0.6f, 0.4f)), std::pair(true, Vector3f(0.9f, 0.6f, 0.4f))}) {
      const Vector3f expected = there * back * tint.cwiseProduct(tint);
      const Vector3f open = scene.light(material, by_lamp, -1, tint);
      const Vector3f fraction = scene.light(material, by_lamp, 0.05f, tint).cwiseQuotient(open);
      EXPECT_LT((fraction - expected).cwiseAbs().maxCoeff(), 0.03f)
          << fraction.transpose() << " for " << expected.transpose() << "; lamp " << by_lamp << ", metallic "
          << material.metallic << ", roughness " << material.roughness;
    }
  // A thin sheet has one surface.
  const Material metal{.color = {0.8f, 0.8f, 0.8f, 1}, .metallic = 1, .roughness = 0.4f};
  const float one = 1 - fresnel_of_pane(-scene.to_light.z());
  const float fraction =
      scene.light(metal, false, 0, {1, 1, 1}).y() / scene.light(metal, false, -1, {1, 1, 1}).y();
  EXPECT_NEAR(fraction, one * back, 0.03f);
}

}  // namespace
}  // namespace offstage::render
