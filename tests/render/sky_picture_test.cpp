// Pictures of the sky as light, against closed forms.

#include "render/sky_picture.h"

#include "render/error.h"
#include "render/frame_files.h"
#include "render/image_io.h"
#include "render/mesh_io.h"
#include "render/sky.h"
#include "render/tone_map.h"
#include "render/trace/ray_material.h"
#include "render/trace/ray_scene.h"
#include "tests/render/gl_fixture.h"
#include "tests/render/gltf_samples.h"
#include "tests/render/scratch.h"

namespace offstage::render {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// Returns a picture of the sky in which a pixel has radiance(direction).
template <class Radiance>
HdrImage sky_of(Radiance radiance, int columns = 256) {
  HdrImage image{columns, columns / 2, {}};
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < columns; ++x) {
      const float angle = 2 * kPi * ((static_cast<float>(x) + 0.5f) / static_cast<float>(columns) - 0.5f);
      const float polar = kPi * (static_cast<float>(y) + 0.5f) / static_cast<float>(image.height_px);
      const Vector3f d(std::sin(polar) * std::sin(angle), std::cos(polar),
                       -std::sin(polar) * std::cos(angle));
      const Vector3f value = radiance(d);
      image.rgba.insert(image.rgba.end(), {value.x(), value.y(), value.z(), 1});
    }
  }
  return image;
}

/// Returns a black sky with a disc of this radius around a direction.
HdrImage disc_sky(const Vector3f& middle, float radius_deg, const Vector3f& radiance, float rest = 0,
                  int columns = 256) {
  const float edge = std::cos(radius_deg * kPi / 180);
  return sky_of(
      [&](const Vector3f& d) { return d.dot(middle) > edge ? radiance : Vector3f(Vector3f::Constant(rest)); },
      columns);
}

float irradiance_at(const TurnedSky& sky, const Vector3f& n) {
  const std::array<Vector3f, 9> c = sky.irradiance();
  const std::array<float, 9> basis = sky_basis(n);
  float sum = 0;
  for (std::size_t k = 0; k < 9; ++k) sum += basis[k] * c[k].y();
  return sum;
}

TEST(SkyPicture, OfOneColourIsThatColourEverywhere) {
  const auto picture =
      std::make_shared<const SkyPicture>(sky_of([](const Vector3f&) { return Vector3f(0.3f, 0.6f, 0.9f); }));
  EXPECT_FALSE(picture->has_bright_part());
  for (const Vector3f& d :
       {Vector3f(1, 0, 0), Vector3f(0, 1, 0), Vector3f(0.3f, -0.7f, 0.65f).normalized()}) {
    EXPECT_NEAR(picture->seen(d).y(), 0.6f, 0.002f);  // the packed format has nine bits
    EXPECT_NEAR(picture->dim(d).y(), 0.6f, 1e-6f);
    EXPECT_NEAR(irradiance_at({picture, 0.4f, 2}, d), 1.2f, 1e-3f);
    for (const float roughness : {0.0f, 0.3f, 0.6f, 1.0f})
      EXPECT_NEAR(picture->mirrored(d, roughness).z(), 0.9f, 1e-4f) << roughness;
  }
}

// On a white surface that faces a disc of radius r, the light of the disc is L sin(r)^2, and the light of the
// rest of the sky is R (1 - sin(r)^2). Edges of 0.35 degrees change the light of the disc by 1 %.
TEST(SkyPicture, DimAndBrightPartAddUpToTheLightOfADisc) {
  const Vector3f middle = Vector3f(0.5f, 0.7f, -0.3f).normalized();
  const float fraction = std::pow(std::sin(12 * kPi / 180), 2.0f);
  const SkyPicture picture(disc_sky(middle, 12, {20, 40, 10}, 0.5f, 1024));
  ASSERT_TRUE(picture.has_bright_part());
  Vector3f bright = Vector3f::Zero(), mean = Vector3f::Zero();
  constexpr int kSamples = 64;
  for (int i = 0; i < kSamples * kSamples; ++i) {
    const Vector2f uv((static_cast<float>(i % kSamples) + 0.5f) / kSamples,
                      (static_cast<float>(i / kSamples) + 0.5f) / kSamples);
    const SkyPicture::Sample sample = picture.sample(uv);
    EXPECT_GT(sample.direction.dot(middle), std::cos(12.5f * kPi / 180));
    if (sample.direction.dot(middle) > std::cos(11 * kPi / 180)) {  // seen() interpolates at the edge
      EXPECT_NEAR(picture.bright_fraction(sample.direction) * picture.seen(sample.direction).y() /
                      (sample.light.y() * picture.density(sample.direction)),
                  1, 0.01f);
    }
    bright += sample.light * (std::max(sample.direction.dot(middle), 0.0f) / kPi);
    mean += sample.direction;
  }
  bright /= kSamples * kSamples;
  const auto at_middle = [&](const SkyPicture& p) {
    return irradiance_at({std::make_shared<const SkyPicture>(p), 0, 1}, middle);
  };
  EXPECT_NEAR((bright.y() + at_middle(picture)) / (40 * fraction + 0.5f * (1 - fraction)), 1, 0.02f);
  EXPECT_NEAR(bright.x() / bright.y(), 0.5f, 1e-3f);
  EXPECT_GT(mean.normalized().dot(middle), 0.9999f);
  EXPECT_GT(picture.beam().direction.dot(middle), 0.9999f);
  EXPECT_NEAR(picture.beam().light.y() / bright.y(), 1, 0.01f);
  EXPECT_NEAR(picture.beam().size_deg, 24, 1);
}

TEST(SkyPicture, TurnsCounterClockwiseAsSeenFromAbove) {
  const TurnedSky sky{nullptr, 0.5f * kPi, 1};
  EXPECT_NEAR((sky.from_picture({1, 0, 0}) - Vector3f(0, 0, -1)).norm(), 0, 1e-6f);
  const Vector3f d = Vector3f(0.2f, 0.5f, -0.8f).normalized();
  EXPECT_NEAR((sky.to_picture(sky.from_picture(d)) - d).norm(), 0, 1e-6f);
}

TEST(SkyPicture, HasTwiceTheWidthAndLight) {
  EXPECT_THROW(SkyPicture({.width_px = 4, .height_px = 4, .rgba = std::vector<float>(64, 1)}),
               std::invalid_argument);
  EXPECT_THROW(SkyPicture({.width_px = 4, .height_px = 2, .rgba = std::vector<float>(32, -1)}),
               std::invalid_argument);
}

/// A stage that is lit only by a picture of the sky.
struct LitStage : SmallStage {
  explicit LitStage(const HdrImage& sky, float turn_deg = 0, bool visible = false, float intensity = 1)
      : SmallStage(160, 120) {
    stage.set_sun({.intensity = 0, .shadows = false});
    Environment environment{.intensity = intensity, .visible = visible};
    environment.picture = std::make_shared<const SkyPicture>(sky);
    environment.picture_turn_deg = turn_deg;
    stage.set_environment(environment);
  }
  void look(const Camera& value) {
    camera = value;
    stage.set_camera(value);
  }
  HdrImage mean_of(int n) {
    HdrImage sum;
    for (int i = 0; i < n; ++i) stage.draw(sample_offsets(i, n), sum);
    for (float& value : sum.rgba) value /= static_cast<float>(n);
    return sum;
  }
  Vector2f place_of(const Vector3f& point) const { return project(camera, point, 160, 120); }
  Camera camera;
};

Vector3f mean_color(const HdrImage& picture, const Vector2f& place, int half) {
  Vector3f sum = Vector3f::Zero();
  for (int dy = -half; dy <= half; ++dy)
    for (int dx = -half; dx <= half; ++dx)
      sum += pixel(picture, static_cast<int>(place.x()) + dx, static_cast<int>(place.y()) + dy).head<3>();
  return sum / static_cast<float>((2 * half + 1) * (2 * half + 1));
}

const Material kWhitePlaster{.color = {1, 1, 1, 1}, .roughness = 1};

// The furnace: a white ball in a picture of one colour cannot be distinguished from the picture behind it.
TEST(StageSkyPicture, AWhiteBallVanishesInAPictureOfOneColour) {
  LitStage s(sky_of([](const Vector3f&) { return Vector3f(Vector3f::Constant(0.35f)); }), 0, true, 2);
  s.add(make_sphere(1), kWhitePlaster);
  s.look({.eye = {0, 0, 4}, .target = {0, 0, 0}});
  const HdrImage picture = s.mean_of(4);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) EXPECT_NEAR(pixel(picture, x, y).y(), 0.7f, 0.007f) << x << ", " << y;
}

// A bright disc of radius r, whose middle has the cosine c to the normal: the radiance of a white floor is
// L sin(r)^2 c. (A rough dielectric reflects up to 4 % more, as in sunlight.)
TEST(StageSkyPicture, OfABrightDiscFollowsItsFormFactor) {
  for (const float cosine : {1.0f, 0.5f}) {
    const Vector3f middle(std::sqrt(1 - cosine * cosine), cosine, 0);
    LitStage s(disc_sky(middle, 8, {30, 30, 30}, 0, 1024));
    s.add(make_ground(20), kWhitePlaster);
    s.look({.eye = {0, 3, 3}, .target = {0, 0, 0}});
    const float expected = 30 * std::pow(std::sin(8 * kPi / 180), 2.0f) * cosine;
    const HdrImage picture = s.mean_of(4);
    EXPECT_NEAR(mean_color(picture, s.place_of({0, 0, 0}), 10).y() / expected, 1, 0.05f) << cosine;
  }
}

// A small sun in the picture, three rows of pixels around the zenith, gives light without noise and a shadow,
// where a black ball hides it.
TEST(StageSkyPicture, OfASmallSunHasNoNoise) {
  const float radius_deg = 3 * 180.0f / 512;
  LitStage s(disc_sky(Vector3f(0, 1, 0), radius_deg, {5000, 5000, 5000}, 0.1f, 1024));
  s.add(make_ground(20), kWhitePlaster);
  s.add(make_sphere(0.5f), {.color = {0, 0, 0, 1}, .roughness = 1}, {0, 1, 0});
  s.look({.eye = {0, 5, 5}, .target = {0, 0, 0}, .fov_deg = 50});
  const HdrImage picture = s.mean_of(4);
  const Vector2f open = s.place_of({1.6f, 0, 0});
  const float lit = mean_color(picture, open, 4).y();
  float variance = 0;
  for (int dy = -4; dy <= 4; ++dy)
    for (int dx = -4; dx <= 4; ++dx)
      variance +=
          std::pow(pixel(picture, static_cast<int>(open.x()) + dx, static_cast<int>(open.y()) + dy).y() - lit,
                   2.0f) /
          81;
  EXPECT_LT(std::sqrt(variance) / lit, 0.01f);
  EXPECT_NEAR(lit / (5000 * std::pow(std::sin(radius_deg * kPi / 180), 2.0f) + 0.1f), 1, 0.06f);
  EXPECT_LT(mean_color(picture, s.place_of({0, 0, 0.1f}), 1).y() / lit, 0.1f);
}

// Red light from +x and blue light from -x; half a turn exchanges them.
TEST(StageSkyPicture, TurnsWithThePicture) {
  const HdrImage sky =
      sky_of([](const Vector3f& d) { return d.x() > 0 ? Vector3f(1, 0, 0) : Vector3f(0, 0, 1); });
  for (const float turn : {0.0f, 180.0f}) {
    LitStage s(sky, turn);
    s.add(make_box({0.2f, 2, 2}), kWhitePlaster);
    s.look({.eye = {4, 0, 0}, .target = {0, 0, 0}});
    const Vector3f color = mean_color(s.mean_of(4), {80, 60}, 5);
    EXPECT_GT(turn == 0 ? color.x() / color.z() : color.z() / color.x(), 20);
  }
}

// The background shows the picture in the directions of its pixels.
TEST(StageSkyPicture, BackgroundIsThePictureAroundTheEye) {
  const auto color = [](const Vector3f& d) {
    return Vector3f(d.x() > 0 ? 0.8f : 0.2f, d.y() > 0 ? 0.9f : 0.1f, d.z() < 0 ? 0.7f : 0.3f);
  };
  LitStage s(sky_of(color), 0, true);
  for (const Vector3f& way :
       {Vector3f(0.5f, 0.4f, -0.7f), Vector3f(-0.5f, -0.4f, 0.7f), Vector3f(-0.8f, 0.3f, -0.5f)}) {
    s.look({.eye = {0, 0, 0}, .target = way});
    const Vector4f seen = center_pixel(s.draw());
    EXPECT_NEAR((seen.head<3>() - color(way)).norm(), 0, 0.01f) << way.transpose();
    EXPECT_EQ(seen.w(), 1);
  }
  s.look({.eye = {0, 0, 0}, .target = {0, 0, -1}});
  const HdrImage picture = s.draw();  // right is +x, up is +y
  EXPECT_NEAR((pixel(picture, 140, 20).head<3>() - Vector3f(0.8f, 0.9f, 0.7f)).norm(), 0, 0.01f);
  EXPECT_NEAR((pixel(picture, 20, 100).head<3>() - Vector3f(0.2f, 0.1f, 0.7f)).norm(), 0, 0.01f);
}

TEST(StageSkyPicture, BackgroundIsBlurredOrHidden) {
  const HdrImage sky =
      sky_of([](const Vector3f& d) { return d.x() > 0 ? Vector3f(1, 1, 1) : Vector3f(0, 0, 0); });
  LitStage s(sky);
  Environment environment{
      .zenith = {0.1f, 0.2f, 0.3f}, .horizon = {0.1f, 0.2f, 0.3f}, .ground = {0.1f, 0.2f, 0.3f}};
  environment.picture = std::make_shared<const SkyPicture>(sky, 10.0f);
  s.stage.set_environment(environment);
  // The Gaussian blurs the edge to a normal distribution of the angle.
  for (const float angle_deg : {-10.0f, 0.0f, 10.0f, 20.0f}) {
    const float a = angle_deg * kPi / 180;
    s.look({.eye = {0, 0, 0}, .target = {std::sin(a), 0, -std::cos(a)}});
    EXPECT_NEAR(center_pixel(s.draw()).y(), 0.5f + 0.5f * std::erf(angle_deg / 10 / std::sqrt(2.0f)), 0.02f);
  }
  environment.picture_visible = false;
  s.stage.set_environment(environment);
  s.look({.eye = {0, 0, 4}, .target = {0, 0, 0}});
  s.add(make_sphere(1), kWhitePlaster);
  const HdrImage picture = s.mean_of(4);
  EXPECT_NEAR(pixel(picture, 5, 5).y(), 0.2f, 0.01f);
  EXPECT_GT(mean_color(picture, {100, 60}, 2).y(), 0.6f);  // the right half is lit, the left one is not
  EXPECT_LT(mean_color(picture, {60, 60}, 2).y(), 0.4f);
}

// A small, very bright sun. Where its blurred image is still brighter than the sky, it is round.
TEST(StageSkyPicture, ABlurredSunIsRound) {
  const HdrImage sky = disc_sky(Vector3f(0, 0, -1), 2, {30000, 30000, 30000}, 0.01f, 512);
  LitStage s(sky);
  Environment environment;
  environment.picture = std::make_shared<const SkyPicture>(sky, 3.0f);
  s.stage.set_environment(environment);
  const float away = std::tan(12 * kPi / 180);  // four standard deviations
  std::vector<float> seen;
  for (int k = 0; k < 16; ++k) {
    const float turn = kPi / 8 * static_cast<float>(k);
    s.look({.eye = {0, 0, 0}, .target = {away * std::cos(turn), away * std::sin(turn), -1}, .fov_deg = 5});
    seen.push_back(center_pixel(s.draw()).y());
  }
  const auto [least, most] = std::ranges::minmax(seen);
  EXPECT_GT(least, 1);
  EXPECT_LT(most / least, 1.3f);
}

// A rough mirror shows the mean of the sky over its lobe, which is partly found by the rays of the mirror
// image and partly by those to the bright part: the integral of the density of mirrored directions times the
// radiance.
TEST(StageSkyPicture, RoughMetalMirrorsTheBrightPartOnce) {
  const Vector3f middle = Vector3f(0, 1, -1).normalized();
  const HdrImage sky = disc_sky(middle, 5, {40, 40, 40}, 0.05f, 1024);
  const SkyPicture whole(sky);
  for (const float roughness : {0.15f, 0.25f, 0.4f}) {
    LitStage s(sky);
    s.add(make_ground(20), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = roughness});
    s.look({.eye = {0, 3, 3}, .target = {0, 0, 0}, .fov_deg = 10});
    const float a = roughness * roughness, a2 = a * a, nv = std::sqrt(0.5f);
    const Vector3f view = Vector3f(0, 1, 1).normalized();
    double sum = 0, all = 0;
    for (int y = 0; y < 256; ++y) {  // the upper half
      for (int x = 0; x < 1024; ++x) {
        const float angle = 2 * kPi * ((static_cast<float>(x) + 0.5f) / 1024 - 0.5f);
        const float polar = kPi * (static_cast<float>(y) + 0.5f) / 512;
        const Vector3f d(std::sin(polar) * std::sin(angle), std::cos(polar),
                         -std::sin(polar) * std::cos(angle));
        const Vector3f h = (d + view).normalized();
        const float k = h.y() * h.y() * (a2 - 1) + 1;
        const double density = a2 / (2 * kPi * k * k * (nv + std::sqrt(a2 + (1 - a2) * nv * nv)));
        const double angle_of_cell = std::sin(polar) * (kPi / 512) * (2 * kPi / 1024);
        sum += density * angle_of_cell * (d.dot(middle) > std::cos(5 * kPi / 180) ? 40 : 0.05);
        all += density * angle_of_cell;
      }
    }
    ASSERT_NEAR(all, 1, 0.03);
    EXPECT_NEAR(mean_color(s.mean_of(64), {80, 60}, 4).y() / sum, 1, 0.06f) << roughness;
  }
}

/// Returns the split-sum reflectance of light.glsl (B. Karis, 2014) of a dielectric.
float reflectance_of_glass(float roughness, float nv) {
  const Vector4f r =
      roughness * Vector4f(-1, -0.0275f, -0.572f, 0.022f) + Vector4f(1, 0.0425f, 1.04f, -0.04f);
  const float t = std::min(r.x() * r.x(), std::exp2(-9.28f * nv)) * r.x() + r.y();
  return 0.04f * (-1.04f * t + r.z()) + (1.04f * t + r.w());
}

// Black glass shows only its mirror image: the mean of the sky over the lobe times the reflectance. The
// bright part is so large that both strategies to find it have a weight.
TEST(StageSkyPicture, RoughGlassMirrorsTheBrightPartOnce) {
  const Vector3f middle = Vector3f(0, 1, -1).normalized(), view = Vector3f(0, 1, 1).normalized();
  const HdrImage sky = disc_sky(middle, 20, {20, 20, 20}, 0.2f, 512);
  for (const float roughness : {0.2f, 0.35f, 0.5f}) {
    LitStage s(sky);
    s.add(make_box({20, 1, 20}), {.color = {0, 0, 0, 1}, .roughness = roughness, .transmission = 1},
          {0, -0.5f, 0});
    s.look({.eye = {0, 3, 3}, .target = {0, 0, 0}, .fov_deg = 10});
    const float a = roughness * roughness, a2 = a * a, nv = std::sqrt(0.5f);
    double sum = 0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 512; ++x) {
        const float angle = 2 * kPi * ((static_cast<float>(x) + 0.5f) / 512 - 0.5f);
        const float polar = kPi * (static_cast<float>(y) + 0.5f) / 256;
        const Vector3f d(std::sin(polar) * std::sin(angle), std::cos(polar),
                         -std::sin(polar) * std::cos(angle));
        const float nh = (d + view).normalized().y(), k = nh * nh * (a2 - 1) + 1;
        const double density = a2 / (2 * kPi * k * k * (nv + std::sqrt(a2 + (1 - a2) * nv * nv)));
        sum += density * std::sin(polar) * (kPi / 256) * (2 * kPi / 512) *
               (d.dot(middle) > std::cos(20 * kPi / 180) ? 20 : 0.2);
      }
    }
    EXPECT_NEAR(mean_color(s.mean_of(64), {80, 60}, 4).y() / (sum * reflectance_of_glass(roughness, nv)), 1,
                0.15f)
        << roughness;
  }
}

// A sun of 5000 times the brightness of white is as bright in a mirror, and in a mirror of a mirror, as in
// the sky. A pane transmits the light that it does not mirror.
TEST(StageSkyPicture, ABrightSunIsAsBrightInAMirrorAndBehindAPane) {
  const Vector3f sun = Vector3f(0, 1, -1).normalized();
  const HdrImage sky = disc_sky(sun, 4, {5000, 4000, 2000}, 0.1f, 1024);
  const Material mirror{.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0};
  {
    LitStage s(sky);
    s.add(make_ground(20), mirror);
    s.look({.eye = {0, 3, 3}, .target = {0, 0, 0}, .fov_deg = 4});
    const Vector3f seen = mean_color(s.mean_of(4), {80, 60}, 4);
    EXPECT_NEAR(seen.x() / 5000, 1, 0.02f);
    EXPECT_NEAR(seen.z() / 2000, 1, 0.02f);
  }
  {
    LitStage s(sky, 0, true);
    s.add(make_box({9, 9, 0.001f}), {.color = {1, 1, 1, 1}, .roughness = 0, .transmission = 1, .thin = true});
    s.look({.eye = -3 * sun, .target = {0, 0, 0}, .fov_deg = 4});
    EXPECT_GT(mean_color(s.mean_of(4), {80, 60}, 4).x(), 0.8f * 5000);
  }
}

// A mirror shows a white wall under a small sun. The sun is sampled as a lamp at the wall, so its light must
// not be added a second time for paths that bounce from the wall to the sun by chance.
TEST(StageSkyPicture, AMirrorShowsAWallAsBrightAsItIs) {
  const Vector3f sun = Vector3f(0, 1, 1).normalized();
  LitStage s(disc_sky(sun, 10, {100, 100, 100}, 0, 512));
  s.add(make_box({30, 30, 0.1f}), kWhitePlaster, {0, 0, -8});
  s.add(make_ground(3), {.color = {1, 1, 1, 1}, .metallic = 1, .roughness = 0});
  s.look({.eye = {0, 3, 3}, .target = {0, 0, 0}, .fov_deg = 4});
  const float in_mirror = mean_color(s.mean_of(16), {80, 60}, 8).y();
  s.look({.eye = {0, 3, 3}, .target = {0, 8, -8}, .fov_deg = 4});
  EXPECT_NEAR(in_mirror / mean_color(s.mean_of(16), {80, 60}, 8).y(), 1, 0.05f);
}

// --- Files ---

TEST(LightImage, RadianceIsMantissaTimesTwoToTheExponent) {
  const ScratchFolder folder;
  std::string text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n";
  text += {static_cast<char>(128), 64,  32, static_cast<char>(129),
           static_cast<char>(200), 100, 0,  static_cast<char>(140)};
  const LightImage light = read_light_image(folder.put("a.hdr", text));
  ASSERT_EQ(light.image.width_px, 2);
  EXPECT_EQ(pixel(light.image, 0, 0), Vector4f(1, 0.5f, 0.25f, 1));
  EXPECT_EQ(pixel(light.image, 1, 0), Vector4f(3200, 1600, 0, 1));
  EXPECT_TRUE(light.warnings.empty());
  EXPECT_THROW(read_texture(folder.put("c.hdr", text)), FileError) << "it is no texture";
}

/// Runs a decoder over all beginnings of a file: they are refused with its name, or nothing of the picture is
/// missing.
void expect_cut_files_refused(const std::vector<uint8_t>& bytes, const auto& decode) {
  const auto whole = decode(bytes);
  std::size_t refused = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    try {
      EXPECT_EQ(decode(std::span(bytes).first(size)), whole) << size << " of " << bytes.size();
    } catch (const FileError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find("cut: "), 0u) << error.what();
    }
  }
  EXPECT_GE(refused + 16, bytes.size());
}

std::vector<uint8_t> bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

TEST(CutPictures, AreRefusedByName) {
  const auto as_light = [](std::span<const uint8_t> bytes) {
    return decode_light_image(bytes, "cut").image.rgba;
  };
  const auto as_texture = [](std::span<const uint8_t> bytes) { return decode_image(bytes, "cut").rgba; };
  Image image{24, 16, {}};
  for (int i = 0; i < 24 * 16; ++i)
    for (const int k : {i * 7, i * 3, i, 255}) image.rgba.push_back(static_cast<uint8_t>(k | 64));
  expect_cut_files_refused(encode_png(image), as_texture);
  expect_cut_files_refused(encode_jpeg(image, ""), as_texture);
  std::string pixels, flat = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 6\n", ppm = "P6 24 16 255\n";
  for (int i = 0; i < 3 * 6 * 4; ++i) flat += static_cast<char>(i % 4 == 3 ? 129 : 64 + i);
  for (int i = 0; i < 24 * 16 * 3; ++i) ppm += static_cast<char>(64 + i % 100);
  expect_cut_files_refused(bytes_of(flat), as_light);
  expect_cut_files_refused(bytes_of(ppm), as_texture);
  std::string tga(18, '\0');
  tga[2] = 2;
  tga[12] = 24;
  tga[14] = 16;
  tga[16] = 24;
  expect_cut_files_refused(bytes_of(tga + ppm.substr(13)), as_texture);
}

TEST(LightImage, OpenExrIsReadAsWrittenAndRepairedWithAWarning) {
  const ScratchFolder folder;
  HdrImage image{4, 2, {}};
  for (int i = 0; i < 32; ++i) image.rgba.push_back(i % 4 == 3 ? 1.0f : 0.25f * static_cast<float>(i));
  write_exr(folder.path() / "a.exr", image, "");
  EXPECT_EQ(read_light_image(folder.path() / "a.exr").image.rgba, image.rgba);
  image.rgba[0] = -3;
  image.rgba[5] = std::numeric_limits<float>::quiet_NaN();
  write_exr(folder.path() / "b.exr", image, "");
  const LightImage repaired = read_light_image(folder.path() / "b.exr");
  EXPECT_EQ(repaired.image.rgba[0], 0);
  EXPECT_EQ(repaired.image.rgba[5], 0);
  EXPECT_EQ(repaired.warnings,
            (std::vector<std::string>{"2 values are negative or not numbers; 0 was used"}));
  std::vector<uint8_t> bytes = read_file(folder.path() / "a.exr", 1 << 20);
  for (std::size_t size = 0; size < bytes.size(); size += 7)
    EXPECT_THROW(decode_light_image(std::span(bytes).first(size), "a"), FileError) << size;
}

// A PNG with 16 bits per sample: 0x8000, 0x8001, 0xFFFF and 0x0001, 0x4000, 0x8080.
TEST(LightImage, PngOfSixteenBitsKeepsThemAsLightAndHasEightAsTexture) {
  const std::vector<uint8_t> png = base64_bytes(
      "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABEAIAAAAr0DSeAAAAFUlEQVR4nGNoYGhg/"
      "P+fgdGBoaEBAByMBEHvADAzAAAAAElFTkSuQmCC");
  const HdrImage light = decode_light_image(png, "a").image;
  EXPECT_FLOAT_EQ(light.rgba[0], srgb_decode(32768.0f / 65535));
  EXPECT_FLOAT_EQ(light.rgba[4], srgb_decode(1.0f / 65535));
  EXPECT_GT(light.rgba[1], light.rgba[0]) << "by the last bit";
  const Image texture = decode_image(png, "a");
  EXPECT_EQ(texture.rgba, (std::vector<uint8_t>{128, 128, 255, 255, 0, 64, 128, 255}));
}

// --- Textures ---

/// Returns a picture of two colours, side by side.
Image half_red_half_green() {
  return {2, 1, {255, 0, 0, 255, 0, 255, 0, 255}};
}

// One copy is 2 m wide: seen from outside of each face, red is right of the middle, as a viewer who stands
// upright sees it; and so it is for rays.
TEST(StageTriplanar, LaysTheTextureUprightOnEachSide) {
  Material material{.color = {1, 1, 1, 1}, .triplanar = true, .unlit = true};
  material.base_color_texture = {.image = 0, .nearest = true};
  material.base_color_texture.rows = {Vector3f(0.5f, 0, 0), Vector3f(0, 0.5f, 0)};
  const std::vector<Image> textures = {half_red_half_green()};
  SmallStage s;
  s.stage.add_instance(s.stage.add_mesh(make_box({1.6f, 1.6f, 1.6f})),
                       s.stage.add_material(material, textures));
  const RayMaterial rays(material, textures);
  for (const Vector3f& side : {Vector3f(1, 0, 0), Vector3f(-1, 0, 0), Vector3f(0, 1, 0), Vector3f(0, -1, 0),
                               Vector3f(0, 0, 1), Vector3f(0, 0, -1)}) {
    const Camera camera{
        .eye = 5 * side, .target = {0, 0, 0}, .up = side.y() != 0 ? Vector3f(0, 0, -1) : Vector3f(0, 1, 0)};
    s.stage.set_camera(camera);
    const Vector3f right = (-side).cross(camera.up).normalized();
    const HdrImage picture = s.draw();
    for (const float x : {-0.5f, 0.5f}) {
      const Vector3f point = 0.8f * side + x * right;
      const Vector2f place = project(camera, point, 96, 64);
      const Vector3f expected = x > 0 ? Vector3f(1, 0, 0) : Vector3f(0, 1, 0);
      const Vector4f seen = pixel(picture, static_cast<int>(place.x()), static_cast<int>(place.y()));
      EXPECT_NEAR((seen.head<3>() - expected).norm(), 0, 0.01f) << side.transpose() << ", " << x;
      Hit hit;
      hit.object_position = point;
      hit.object_normal = side;
      EXPECT_NEAR((rays.color(hit, 0).head<3>() - expected).norm(), 0, 0.01f)
          << side.transpose() << ", " << x;
    }
  }
}

// Where the normal is between two axes, both projections are mixed.
TEST(StageTriplanar, BlendsBetweenTheSides) {
  Material material{.color = {1, 1, 1, 1}, .triplanar = true};
  material.base_color_texture = {.image = 0, .nearest = true};
  material.base_color_texture.rows = {Vector3f(0.5f, 0, 0), Vector3f(0, 0.5f, 0)};
  const std::vector<Image> textures = {half_red_half_green()};
  const RayMaterial rays(material, textures);
  Hit hit;
  hit.object_position = {0.5f, 0, 0.5f};  // red from +Z, green from +X
  hit.object_normal = Vector3f(1, 0, 1).normalized();
  EXPECT_NEAR((rays.color(hit, 0).head<3>() - Vector3f(0.5f, 0.5f, 0)).norm(), 0, 0.01f);
}

}  // namespace
}  // namespace offstage::render
