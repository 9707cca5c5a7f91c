#include <gtest/gtest.h>

#include "gltf_samples.h"
#include "model_picture.h"
#include "scratch.h"

// Each test draws a small file and looks at pixels whose colour follows from the glTF specification.

namespace offstage::render {
namespace {

class Picture : public ModelPicture {
 public:
  explicit Picture(const GltfSample& sample) : ModelPicture(ScratchFolder().put("a.gltf", sample.text())) {}
};

const Json kNearestTexels = {{"magFilter", 9728}, {"minFilter", 9728}};

Json nearest_with(const char* key, int value) {
  Json sampler = kNearestTexels;
  sampler[key] = value;
  return sampler;
}

TEST(GltfPicture, VertexColoursMultiplyTheBaseColour) {
  GltfSample sample;
  sample.make_unlit();
  sample.pbr()["baseColorFactor"] = {0.5, 1, 0.25, 1};
  sample.set("COLOR_0", std::vector<uint8_t>{255, 0, 0, 255, 0, 0, 255, 255, 0, 0, 255, 255, 255, 0, 0, 255},
             "VEC4", true);
  Picture picture(sample);
  const Vector3f left = picture.color_at(-0.9f, 0), right = picture.color_at(0.9f, 0);
  expect_color(left, {0.475f, 0, 0.0125f}, 0.02f);  // 95 % red
  expect_color(right, {0.025f, 0, 0.2375f}, 0.02f);
}

TEST(GltfPicture, AlphaMaskCutsHolesAndIsOpaqueElsewhere) {
  for (const double cutoff : {0.5, 0.2}) {
    GltfSample sample;
    sample.make_unlit();
    const int texture =
        sample.texture(encoded_texels(2, 1, {{1, 0, 0, 0.3f}, {0, 1, 0, 0.7f}}), kNearestTexels);
    sample.pbr()["baseColorTexture"] = {{"index", texture}};
    sample.material()["alphaMode"] = "MASK";
    sample.material()["alphaCutoff"] = cutoff;
    Picture picture(sample);
    const Vector4f left = picture.at(-0.5f, 0), right = picture.at(0.5f, 0);
    EXPECT_EQ(left.w(), cutoff == 0.5 ? 0 : 1) << cutoff;
    EXPECT_EQ(right.w(), 1);
    expect_color(right.head<3>(), kPureGreen);
    if (cutoff == 0.2) expect_color(left.head<3>(), kPureRed);
  }
}

TEST(GltfPicture, MasksKeepTheirFractionAtADistance) {
  std::vector<Vector4f> leaves(64 * 64, {1, 1, 1, 0});
  for (std::size_t y = 0; y < 64; ++y)
    for (std::size_t x = 0; x < 64; ++x)  // irregular, so that reduced levels have all shades
      if ((x * x + 3 * y * y + 7 * x * y) % 16 < 5) leaves[64 * y + x].w() = 1;
  const auto opaque_count =
      static_cast<double>(std::ranges::count_if(leaves, [](const Vector4f& c) { return c.w() == 1; }));
  GltfSample sample;
  sample.make_unlit();
  sample.pbr()["baseColorTexture"] = {{"index", sample.texture(encoded_texels(64, 64, leaves))}};
  sample.material()["alphaMode"] = "MASK";
  Picture picture(sample);
  picture.look_from({0, 0, 9});  // four texels for a pixel
  const HdrImage image = picture.draw();
  double covered = 0, all = 0;
  for (float y = -0.9f; y < 0.95f; y += 0.1f)
    for (float x = -0.9f; x < 0.95f; x += 0.1f) {
      covered += picture.at(image, x, y).w() > 0.5f;
      ++all;
    }
  EXPECT_NEAR(covered / all, opaque_count / 4096, 0.12);
}

TEST(GltfPicture, BlendingUsesTheAlphaOfFactorAndVertices) {
  GltfSample sample;
  sample.make_unlit();
  sample.material()["alphaMode"] = "BLEND";
  sample.pbr()["baseColorFactor"] = {1, 1, 1, 0.8};
  sample.set("COLOR_0", std::vector<float>(16, 0.5f), "VEC4");
  EXPECT_NEAR(Picture(sample).at(0, 0).w(), 0.4f, 5e-3f);
  sample.material().erase("alphaMode");
  EXPECT_EQ(Picture(sample).at(0, 0).w(), 1) << "OPAQUE ignores alpha";
}

TEST(GltfPicture, SamplersWrapAndFilter) {
  const auto draw = [](const Json& sampler, const std::function<void(Picture&)>& look) {
    GltfSample sample;
    sample.make_unlit();
    sample.set("TEXCOORD_0", std::vector<float>{-1, 0.5f, 2, 0.5f, 2, 0.5f, -1, 0.5f}, "VEC2");
    const int texture =
        sample.texture(encoded_texels(2, 1, {opaque_texel(kPureRed), opaque_texel(kPureBlue)}), sampler);
    sample.pbr()["baseColorTexture"] = {{"index", texture}};
    Picture picture(sample);
    look(picture);
  };
  // u = -0.75, -0.25, 0.25, 0.75, 1.25, 1.75 from left to right.
  const auto expect_row = [](Picture& picture, const std::vector<Vector3f>& colors) {
    for (std::size_t i = 0; i < colors.size(); ++i)
      expect_color(picture.color_at(-5 / 6.0f + static_cast<float>(i) / 3, 0), colors[i]);
  };
  draw(nearest_with("wrapS", 10497), [&](Picture& p) {
    expect_row(p, {kPureRed, kPureBlue, kPureRed, kPureBlue, kPureRed, kPureBlue});
  });
  draw(nearest_with("wrapS", 33648), [&](Picture& p) {
    expect_row(p, {kPureBlue, kPureRed, kPureRed, kPureBlue, kPureBlue, kPureRed});
  });
  draw(nearest_with("wrapS", 33071), [&](Picture& p) {
    expect_row(p, {kPureRed, kPureRed, kPureRed, kPureBlue, kPureBlue, kPureBlue});
  });
  draw({{"magFilter", 9729}, {"wrapS", 33071}}, [&](Picture& p) {
    const Vector3f middle = p.color_at(0, 0);  // between the texels
    EXPECT_NEAR(middle.x(), 0.5f, 0.1f);
    EXPECT_NEAR(middle.z(), 0.5f, 0.1f);
  });
}

TEST(GltfPicture, EachTextureHasItsSetOfCoordinates) {
  GltfSample sample;
  sample.set("TEXCOORD_3", std::vector<float>{0.75f, 0.5f, 0.75f, 0.5f, 0.75f, 0.5f, 0.75f, 0.5f}, "VEC2");
  const int texture =
      sample.texture(encoded_texels(2, 1, {opaque_texel(kPureRed), opaque_texel(kPureBlue)}), kNearestTexels);
  sample.pbr() = {{"baseColorTexture", {{"index", texture}}}};
  sample.material()["emissiveTexture"] = {{"index", texture}, {"texCoord", 3}};
  sample.material()["emissiveFactor"] = {1, 1, 1};
  Picture glow(sample);
  expect_color(glow.color_at(-0.5f, 0), kPureBlue);
  sample.pbr()["baseColorTexture"]["texCoord"] = 3;
  sample.material()["emissiveTexture"]["texCoord"] = 0;
  Picture swapped(sample);
  expect_color(swapped.color_at(-0.5f, 0), kPureRed);
}

/// A texture of a material, and a function that makes it visible and returns the object that refers to it.
struct TextureUse {
  const char* name;
  std::function<Json&(GltfSample&)> texture;
};
const std::vector<TextureUse> kTextureUses = {
    {"base colour", [](GltfSample& s) -> Json& { return s.pbr()["baseColorTexture"]; }},
    {"metallic and roughness", [](GltfSample& s) -> Json& { return s.pbr()["metallicRoughnessTexture"]; }},
    {"emission",
     [](GltfSample& s) -> Json& {
       s.material()["emissiveFactor"] = {1, 1, 1};
       return s.material()["emissiveTexture"];
     }},
    {"normal", [](GltfSample& s) -> Json& { return s.material()["normalTexture"]; }},
    {"occlusion", [](GltfSample& s) -> Json& { return s.material()["occlusionTexture"]; }},
    {"transmission",
     [](GltfSample& s) -> Json& {
       s.pbr() = {{"metallicFactor", 0}, {"roughnessFactor", 0}};
       Json& extension = s.extension("KHR_materials_transmission");
       extension["transmissionFactor"] = 1;
       return extension["transmissionTexture"];
     }},
    {"specular colour",
     [](GltfSample& s) -> Json& {
       s.pbr() = {{"metallicFactor", 0}, {"roughnessFactor", 0.5}, {"baseColorFactor", {0, 0, 0, 1}}};
       return s.extension("KHR_materials_specular")["specularColorTexture"];
     }},
    {"diffuse",
     [](GltfSample& s) -> Json& {
       Json& extension = s.extension("KHR_materials_pbrSpecularGlossiness");
       extension["specularFactor"] = {0, 0, 0};
       return extension["diffuseTexture"];
     }},
    {"specular and glossiness", [](GltfSample& s) -> Json& {
       return s.extension("KHR_materials_pbrSpecularGlossiness")["specularGlossinessTexture"];
     }}};

// For each texture, `texCoord`, or the `texCoord` of KHR_texture_transform, selects the set of coordinates.
// The other textures have no effect on this.
TEST(GltfPicture, EveryTextureUsesTheSetThatItNames) {
  const std::vector<float> across = {0, 1, 1, 1, 1, 0, 0, 0},
                           at_a_point = {0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f};
  for (const TextureUse& use : kTextureUses) {
    const auto draw = [&](bool second_is_across, const Json& reference) {
      GltfSample sample;
      sample.set("TEXCOORD_0", second_is_across ? at_a_point : across, "VEC2");
      sample.set("TEXCOORD_1", second_is_across ? across : at_a_point, "VEC2");
      const int texture = sample.texture(
          encoded_texels(
              2, 2,
              {{0.9f, 0.5f, 0.8f, 1}, {0.1f, 0.9f, 0.2f, 1}, {0.2f, 0.1f, 0.9f, 1}, {0.5f, 0.5f, 1, 1}}),
          kNearestTexels);
      Json& entry = use.texture(sample);
      entry = reference;
      entry["index"] = texture;
      Picture picture(sample);
      picture.set_sun({1, 1, 2});
      picture.set_sky({0.3f, 0.3f, 0.3f});
      return picture.draw().rgba;
    };
    const auto first = draw(false, Json::object());
    EXPECT_EQ(draw(true, {{"texCoord", 1}}), first) << use.name;
    EXPECT_EQ(draw(true, {{"texCoord", 0}, {"extensions", {{"KHR_texture_transform", {{"texCoord", 1}}}}}}),
              first)
        << use.name;
    EXPECT_NE(draw(true, {{"texCoord", 0}}), first) << use.name;
  }
}

TEST(GltfPicture, TextureTransformsScaleTurnAndMove) {
  const auto draw = [](const Json& transform) {
    GltfSample sample;
    sample.make_unlit();
    const int texture = sample.texture(encoded_texels(2, 2,
                                                      {opaque_texel(kPureRed), opaque_texel(kPureGreen),
                                                       opaque_texel(kPureBlue), opaque_texel(kPureWhite)}),
                                       kNearestTexels);
    sample.pbr()["baseColorTexture"] = {{"index", texture},
                                        {"extensions", {{"KHR_texture_transform", transform}}}};
    sample.document["extensionsUsed"].push_back("KHR_texture_transform");
    Picture picture(sample);
    return std::vector<Vector3f>{picture.color_at(-0.5f, 0.5f), picture.color_at(0.5f, 0.5f),
                                 picture.color_at(-0.5f, -0.5f), picture.color_at(0.5f, -0.5f)};
  };
  const auto expect_quarters = [](const std::vector<Vector3f>& colors,
                                  const std::vector<Vector3f>& expected) {
    for (std::size_t i = 0; i < 4; ++i) expect_color(colors[i], expected[i]);
  };
  expect_quarters(draw(Json::object()), {kPureRed, kPureGreen, kPureBlue, kPureWhite});
  expect_quarters(draw({{"offset", {0.5, 0}}}), {kPureGreen, kPureRed, kPureWhite, kPureBlue});
  expect_quarters(draw({{"scale", {1, -1}}, {"offset", {0, 1}}}),
                  {kPureBlue, kPureWhite, kPureRed, kPureGreen});
  // A quarter turn of the coordinates against the clock turns the image with it: (u, v) -> (v, -u).
  expect_quarters(draw({{"rotation", 1.5707963267948966}}), {kPureBlue, kPureRed, kPureWhite, kPureGreen});
}

TEST(GltfPicture, DoubleSidedSurfacesAreSeenFromBehind) {
  GltfSample sample;
  sample.make_unlit();
  Picture single(sample);
  single.look_from({0, 0, -5});
  EXPECT_EQ(single.at(0, 0).w(), 0);
  sample.material()["doubleSided"] = true;
  Picture both(sample);
  both.look_from({0, 0, -5});
  expect_color(both.color_at(0, 0), kPureWhite);
}

/// Returns the light from the sun on a rough square, by its normals or by its normal map.
Vector3f sunlit(GltfSample& sample, const Vector3f& sun) {
  sample.pbr()["metallicFactor"] = 0;
  sample.pbr()["roughnessFactor"] = 1;
  Picture picture(sample);
  picture.set_sun(sun);
  return picture.color_at(0.1f, 0.1f);
}

TEST(GltfPicture, NormalMapsShadeLikeTheTiltedSurface) {
  const float s = std::sqrt(0.5f);
  // A normal map stores (n + 1) / 2, so one texel tilts the whole square. It must be lit like a square whose
  // vertex normals are tilted by the same 45 degrees: to the right, upwards and to the left.
  for (const Vector3f& normal : {Vector3f(s, 0, s), Vector3f(0, s, s), Vector3f(-s, 0, s)}) {
    GltfSample tilted;
    std::vector<float> normals;
    for (int i = 0; i < 4; ++i) normals.insert(normals.end(), normal.data(), normal.data() + 3);
    tilted.set("NORMAL", normals, "VEC3");
    const Vector3f texel = (normal.array() * 0.5f + 0.5f).matrix();
    for (const Vector3f& sun : {Vector3f(1, 0.2f, 1), Vector3f(-0.3f, 1, 1)}) {
      const Vector3f expected = sunlit(tilted, sun);
      for (const int mode :
           {0, 1, 2}) {  // derived tangents; given ones; mirrored coordinates with given ones
        GltfSample mapped;
        const int texture = mapped.texture(encoded_texels(1, 1, {opaque_texel(texel)}));
        mapped.material()["normalTexture"] = {{"index", texture}};
        if (mode == 1)
          mapped.set("TANGENT", std::vector<float>{1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4");
        if (mode == 2) {  // u to the left: the map's X points to -x
          mapped.set("TEXCOORD_0", std::vector<float>{1, 1, 0, 1, 0, 0, 1, 0}, "VEC2");
          mapped.set("TANGENT", std::vector<float>{-1, 0, 0, -1, -1, 0, 0, -1, -1, 0, 0, -1, -1, 0, 0, -1},
                     "VEC4");
        }
        const Vector3f seen = sunlit(mapped, mode == 2 ? Vector3f(-sun.x(), sun.y(), sun.z()) : sun);
        EXPECT_NEAR(seen.x(), expected.x(), 0.02f * expected.x() + 0.01f)
            << mode << ": " << normal.transpose();
      }
    }
  }
}

TEST(GltfPicture, NormalScaleFlattensTheMap) {
  GltfSample sample;
  const int texture = sample.texture(encoded_texels(1, 1, {{0.854f, 0.5f, 0.854f, 1}}));
  sample.material()["normalTexture"] = {{"index", texture}, {"scale", 0}};
  GltfSample plain;
  EXPECT_NEAR(sunlit(sample, {1, 0, 1}).x(), sunlit(plain, {1, 0, 1}).x(), 0.01f);
}

TEST(GltfPicture, OcclusionHidesTheSkyByItsStrength) {
  std::vector<float> light;
  for (const double strength : {0.0, 0.5, 1.0}) {
    GltfSample sample;
    sample.pbr() = {{"metallicFactor", 0}, {"roughnessFactor", 1}, {"baseColorFactor", {0.1, 0.1, 0.1, 1}}};
    const int texture = sample.texture(encoded_texels(1, 1, {{0, 1, 1, 1}}));
    sample.material()["occlusionTexture"] = {{"index", texture}, {"strength", strength}};
    Picture picture(sample);
    picture.set_sky(kPureWhite);
    light.push_back(picture.color_at(0, 0).x());
  }
  EXPECT_GT(light[0], 0.08f);
  EXPECT_LT(light[1], 0.8f * light[0]);
  EXPECT_GT(light[1], 0.3f * light[0]);
  EXPECT_LT(light[2], 0.01f);
}

// Indirect light is hidden in the reflection of metal, too, and direct light never.
TEST(GltfPicture, OcclusionHidesMirroredLightButNoDirectLight) {
  const auto light = [](double open, double roughness, bool sun) {
    GltfSample sample;
    sample.pbr() = {
        {"metallicFactor", 1}, {"roughnessFactor", roughness}, {"baseColorFactor", {0.5, 0.5, 0.5, 1}}};
    const int texture = sample.texture(encoded_texels(1, 1, {{static_cast<float>(open), 1, 1, 1}}));
    sample.material()["occlusionTexture"]["index"] = texture;
    Picture picture(sample);
    if (sun)
      picture.set_sun({0, 0, 1});
    else
      picture.set_sky(kPureWhite);
    return picture.color_at(0, 0).x();
  };
  for (const double roughness : {0.0, 0.5, 1.0}) {
    const float whole = light(1, roughness, false);
    EXPECT_GT(whole, 0.1f) << roughness;
    EXPECT_LT(light(0, roughness, false), 1e-3f) << roughness;
  }
  EXPECT_NEAR(light(0.5, 1, false) / light(1, 1, false), 0.5f, 0.02f)
      << "rough metal reflects from all around";
  EXPECT_GT(light(1, 0.5, true), 0.01f);
  // The remaining light is the mirror image of the sun's disc.
  EXPECT_NEAR(light(0, 0.5, true) / light(1, 0.5, true), 1, 0.002f);
}

TEST(GltfPicture, EmissiveStrengthScalesTheGlow) {
  GltfSample sample;
  sample.material()["emissiveFactor"] = {0.25, 0.5, 1};
  sample.extension("KHR_materials_emissive_strength")["emissiveStrength"] = 3;
  Picture picture(sample);
  expect_color(picture.color_at(0, 0), {0.75f, 1.5f, 3});
}

TEST(GltfPicture, TransmissionShowsTheBackground) {
  GltfSample sample;
  sample.pbr() = {{"baseColorFactor", {1, 0.5, 1, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0}};
  sample.extension("KHR_materials_transmission")["transmissionFactor"] = 1;
  sample.extension("KHR_materials_ior")["ior"] = 1;
  Picture picture(sample);
  Mesh wall = picture.model().parts.at(0).mesh;
  for (Vector3f& p : wall.positions) p = Vector3f(4 * p.x(), 4 * p.y(), -1);
  const InstanceHandle behind = picture.stage().add_instance(
      picture.stage().add_mesh(wall),
      picture.stage().add_material({.color = {0, 0, 0, 1}, .emission = {0.2f, 0.4f, 0.6f}}), false);
  (void)behind;
  expect_color(picture.color_at(0.2f, 0.2f), {0.2f, 0.2f, 0.6f}, 0.02f);
}

// Two squares with outward fronts enclose glass. The light that passes both has the tint of the nominal
// thickness.
TEST(GltfPicture, AVolumeTintsTheLightThroughItByItsThickness) {
  const auto behind = [](double thickness) {
    GltfSample sample;
    sample.pbr() = {{"metallicFactor", 0}, {"roughnessFactor", 0}};
    sample.extension("KHR_materials_transmission")["transmissionFactor"] = 1;
    sample.extension("KHR_materials_ior")["ior"] = 1;
    sample.extension("KHR_materials_volume") = {
        {"thicknessFactor", thickness}, {"attenuationDistance", 0.5}, {"attenuationColor", {0.25, 0.5, 1}}};
    sample.document["nodes"].push_back(
        {{"mesh", 0}, {"rotation", {0, 1, 0, 0}}, {"translation", {0, 0, -0.5}}});
    sample.document["scenes"][0]["nodes"] = {0, 1};
    Picture picture(sample);
    Mesh wall = picture.model().parts.at(0).mesh;
    for (Vector3f& p : wall.positions) p = Vector3f(4 * p.x(), 4 * p.y(), -2);
    for (Vector3f& n : wall.normals) n = Vector3f::UnitZ();
    picture.stage().add_instance(
        picture.stage().add_mesh(wall),
        picture.stage().add_material({.color = {0, 0, 0, 1}, .emission = {1, 1, 1}, .two_sided = true}),
        false);
    return picture.color_at(0.2f, 0.2f);
  };
  expect_color(behind(0.5), {0.25f, 0.5f, 1}, 0.02f);
  expect_color(behind(0.25), {0.5f, std::sqrt(0.5f), 1}, 0.02f);
}

// A pane before a wall whose right half glows: a rough one spreads the light of the edge.
TEST(GltfPicture, RoughTransmissionBlursTheBackground) {
  const auto light_left_of_the_edge = [](double roughness) {
    GltfSample sample;
    sample.pbr() = {{"metallicFactor", 0}, {"roughnessFactor", roughness}};
    sample.extension("KHR_materials_transmission")["transmissionFactor"] = 1;
    Picture picture(sample);
    Mesh wall = picture.model().parts.at(0).mesh;
    for (Vector3f& p : wall.positions) p = Vector3f(4 + 4 * p.x(), 4 * p.y(), -1);
    const InstanceHandle behind = picture.stage().add_instance(
        picture.stage().add_mesh(wall),
        picture.stage().add_material({.color = {0, 0, 0, 1}, .emission = {1, 1, 1}}), false);
    (void)behind;
    const HdrImage image = picture.draw();
    float sum = 0;  // over points 0.1 to 0.5 m beside the edge
    int count = 0;
    for (float x = -0.5f; x < -0.1f; x += 0.05f)
      for (float y = -0.8f; y < 0.8f; y += 0.05f) {
        sum += picture.at(image, x, y).x();
        ++count;
      }
    return sum / static_cast<float>(count);
  };
  EXPECT_LT(light_left_of_the_edge(0), 0.01f);
  EXPECT_GT(light_left_of_the_edge(0.6), 0.1f);
}

// A film that is a quarter of the wavelength of green thick reflects no green if its index of refraction is
// the square root of the index of the glass (E. Hecht, "Optics", section 9.7). The reflection is purple.
TEST(GltfPicture, AFilmOfAQuarterWaveReflectsPurple) {
  const auto highlight = [](const Json& film, double metallic) {
    GltfSample sample;
    const double base = metallic > 0 ? 0.5 : 0;
    sample.pbr() = {
        {"baseColorFactor", {base, base, base, 1}}, {"metallicFactor", metallic}, {"roughnessFactor", 0.5}};
    if (!film.is_null()) sample.extension("KHR_materials_iridescence") = film;
    Picture picture(sample);
    const bool is_named = std::ranges::any_of(picture.model().warnings, [](const std::string& line) {
      return line.find("KHR_materials_iridescence is approximated") != line.npos;
    });
    EXPECT_EQ(is_named, !film.is_null());
    picture.set_sun({0, 0, 1}, 1);
    return picture.color_at(0, 0);
  };
  const double n = std::sqrt(1.5), quarter = 550 / (4 * n);
  const auto film = [&](double waves, double factor) {
    return Json{{"iridescenceFactor", factor},
                {"iridescenceIor", n},
                {"iridescenceThicknessMaximum", waves * quarter}};
  };
  const Vector3f bare = highlight(Json(), 0), coated = highlight(film(1, 1), 0);
  EXPECT_LT(coated.y(), 0.1f * bare.y());
  EXPECT_GT(std::min(coated.x(), coated.z()), 2 * coated.y());
  EXPECT_LT(coated.maxCoeff(), bare.y());
  const Vector3f half = highlight(film(1, 0.5), 0);
  EXPECT_LT((half - 0.5f * (bare + coated)).cwiseAbs().maxCoeff(), 0.02f * bare.y());
  const Vector3f twice = highlight(film(2, 1), 0);  // a film of half a wavelength has no effect
  EXPECT_NEAR(twice.y() / bare.y(), 1, 0.15f);
  const Vector3f metal = highlight(film(2, 1), 1);
  EXPECT_GT((metal / metal.maxCoeff() - Vector3f::Ones()).cwiseAbs().maxCoeff(), 0.05f) << "metal is tinted";
}

TEST(GltfPicture, IndexOfRefractionAndSpecularSetTheHighlight) {
  const auto highlight = [](const std::function<void(GltfSample&)>& change) {
    GltfSample sample;
    sample.pbr() = {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.5}};
    change(sample);
    Picture picture(sample);
    picture.set_sun({0, 0, 1}, 1);
    return picture.color_at(0, 0);
  };
  const Vector3f usual = highlight([](GltfSample&) {});
  EXPECT_GT(usual.x(), 0.02f);
  const Vector3f none = highlight([](GltfSample& s) { s.extension("KHR_materials_ior")["ior"] = 1; });
  EXPECT_LT(none.x(), 0.1f * usual.x());
  // ((2 - 1) / (2 + 1))^2 = 1 / 9 against 0.04
  const Vector3f strong = highlight([](GltfSample& s) { s.extension("KHR_materials_ior")["ior"] = 2; });
  EXPECT_NEAR(strong.x() / usual.x(), 1 / 0.36f, 0.05f);
  const Vector3f red = highlight([](GltfSample& s) {
    s.extension("KHR_materials_specular") = {{"specularFactor", 0.5}, {"specularColorFactor", {1, 0, 0}}};
  });
  EXPECT_NEAR(red.x() / usual.x(), 0.5f, 0.02f);
  EXPECT_LT(red.y(), 0.1f * usual.y());
}

TEST(GltfPicture, SpecularGlossinessGivesDiffuseAndSpecularColours) {
  GltfSample diffuse;
  diffuse.extension("KHR_materials_pbrSpecularGlossiness") = {
      {"diffuseFactor", {0, 0.5, 0, 1}}, {"specularFactor", {0, 0, 0}}, {"glossinessFactor", 0}};
  Picture matt(diffuse);
  matt.set_sun({0, 0, 1}, 1);
  expect_color(matt.color_at(0, 0), {0, 0.5f, 0}, 0.01f);

  GltfSample mirror;  // black but for a red mirror
  mirror.extension("KHR_materials_pbrSpecularGlossiness") = {
      {"diffuseFactor", {0.5, 0.5, 0.5, 1}}, {"specularFactor", {1, 0, 0}}, {"glossinessFactor", 1}};
  Picture red(mirror);
  red.set_sky({0.5f, 0.5f, 0.5f});
  expect_color(red.color_at(0, 0), {0.5f, 0, 0}, 0.03f);
}

TEST(GltfPicture, ClearcoatAddsAHighlightAndSheenAGlow) {
  const auto lit = [](const std::function<void(GltfSample&)>& change) {
    GltfSample sample;
    sample.pbr() = {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 1}};
    change(sample);
    Picture picture(sample);
    picture.set_sky({0.5f, 0.5f, 0.5f});
    picture.look_from({4.5f, 0, 1.2f});
    return picture.color_at(0, 0);
  };
  const Vector3f plain = lit([](GltfSample&) {});
  const Vector3f coated =
      lit([](GltfSample& s) { s.extension("KHR_materials_clearcoat")["clearcoatFactor"] = 1; });
  const Vector3f velvet = lit([](GltfSample& s) {
    s.extension("KHR_materials_sheen")["sheenColorFactor"] = {1, 0, 0};
  });
  EXPECT_GT(coated.x(), plain.x() + 0.05f);
  EXPECT_GT(velvet.x(), plain.x() + 0.05f);
  EXPECT_LE(velvet.y(), plain.y() + 1e-4f);
}

TEST(GltfPicture, HolesOfAMaskLetTheSunThrough) {
  GltfSample sample;
  const int texture = sample.texture(encoded_texels(2, 1, {{1, 1, 1, 0}, {1, 1, 1, 1}}), kNearestTexels);
  sample.pbr() = {{"baseColorTexture", {{"index", texture}}}};
  sample.material()["alphaMode"] = "MASK";
  const ScratchFolder folder;
  const Model model = read_model(folder.put("a.gltf", sample.text()));
  SmallStage small;
  small.stage.set_environment(
      {.zenith = kPureBlack, .horizon = kPureBlack, .ground = kPureBlack, .visible = false});
  small.stage.set_sun({.direction = {0, 0, 1}, .color = {1, 1, 1}, .intensity = 1, .size_deg = 0.1f});
  small.stage.add_instance(small.stage.add_mesh(model.parts.at(0).mesh),
                           small.stage.add_material(model.materials.at(0), model.textures));
  Mesh wall = model.parts.at(0).mesh;
  for (Vector3f& p : wall.positions) p = Vector3f(3 * p.x(), 3 * p.y(), -1);
  small.stage.add_instance(small.stage.add_mesh(wall),
                           small.stage.add_material({.color = {0.2f, 0.2f, 0.2f, 1}, .roughness = 1}));
  // Seen from below the square, so that the wall behind its lower edge is in view.
  const Camera camera{.eye = {0, -6, 3}, .target = {0, 0, -1}};
  small.stage.set_camera(camera);
  const HdrImage image = small.draw();
  const auto wall_at = [&](float x) {
    const Vector2f place = project(camera, {x, -0.5f, -1}, 96, 64);
    return pixel(image, static_cast<int>(place.x()), static_cast<int>(place.y())).x();
  };
  EXPECT_GT(wall_at(-0.5f), 0.1f) << "behind the hole";
  EXPECT_LT(wall_at(0.5f), 0.02f) << "behind the opaque half";
}

}  // namespace
}  // namespace offstage::render
