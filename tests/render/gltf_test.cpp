#include <gtest/gtest.h>

#include "gltf_samples.h"
#include "render/error.h"
#include "render/mesh_io.h"
#include "scratch.h"

namespace offstage::render {
namespace {

Model read_sample(const GltfSample& sample) {
  const ScratchFolder folder;
  return read_model(folder.put("a.gltf", sample.text()));
}

std::string why_not(const std::string& text, const std::string& name = "a.gltf") {
  const ScratchFolder folder;
  try {
    read_model(folder.put(name, text));
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

bool warns(const Model& model, const std::string& part) {
  return std::ranges::any_of(model.warnings,
                             [&](const std::string& line) { return line.find(part) != line.npos; });
}

void expect_box(const Model& model, const Vector3f& low, const Vector3f& high, float tolerance = 1e-5f) {
  EXPECT_LT((model.bounds().min() - low).norm(), tolerance) << model.bounds().min().transpose();
  EXPECT_LT((model.bounds().max() - high).norm(), tolerance) << model.bounds().max().transpose();
}

/// All triangles of the square face +Z.
void expect_facing_z(const Model& model, float sign = 1) {
  for (const Model::Part& part : model.parts)
    for (std::size_t i = 0; i < part.mesh.indices.size(); i += 3) {
      const auto at = [&](std::size_t k) -> const Vector3f& {
        return part.mesh.positions[part.mesh.indices[i + k]];
      };
      EXPECT_GT(sign * (at(1) - at(0)).cross(at(2) - at(0)).z(), 0);
    }
}

TEST(GltfAccessors, QuantizedAndNormalizedIntegersAreScaled) {
  GltfSample bytes;  // KHR_mesh_quantization: 127 is 1
  bytes.document["extensionsUsed"] = bytes.document["extensionsRequired"] = {"KHR_mesh_quantization"};
  bytes.set("POSITION",
            std::vector<int8_t>{-127, -127, 0, 0, 127, -128, 0, 0, 127, 127, 0, 0, -127, 127, 0, 0}, "VEC4",
            true);
  bytes.document["accessors"].back()["type"] = "VEC3";
  bytes.document["accessors"].back()["count"] = 4;
  bytes.document["bufferViews"].back()["byteStride"] = 4;
  const Model scaled = read_sample(bytes);
  expect_box(scaled, {-1, -1, 0}, {1, 1, 0});
  EXPECT_TRUE(scaled.warnings.empty());

  GltfSample shorts;  // not normalised: the numbers themselves, scaled by the node
  shorts.set("POSITION",
             std::vector<int16_t>{-500, -500, 0, 0, 500, -500, 0, 0, 500, 500, 0, 0, -500, 500, 0, 0},
             "VEC4");
  shorts.document["accessors"].back()["type"] = "VEC3";
  shorts.document["bufferViews"].back()["byteStride"] = 8;
  shorts.document["nodes"][0]["scale"] = {0.01, 0.01, 1};
  expect_box(read_sample(shorts), {-5, -5, 0}, {5, 5, 0});
}

/// Numbers of [0, 1] as normalised integers of a type, or as floats.
template <class T>
std::vector<T> stored(const std::vector<float>& values) {
  std::vector<T> result;
  for (const float value : values) {
    if constexpr (std::is_same_v<T, float>)
      result.push_back(value);
    else
      result.push_back(
          static_cast<T>(std::lround(value * static_cast<float>(std::numeric_limits<T>::max()))));
  }
  return result;
}

// Colours, coordinates and weights are floats or normalised integers, indices integers of any width.
TEST(GltfAccessors, AttributesMayHaveAnyTypeThatTheFormatAllows) {
  const std::vector<float> rgb = {1, 0, 0.2f, 0, 1, 0.4f, 0, 0, 1, 1, 1, 0.6f},
                           uv = {0, 1, 1, 1, 1, 0, 0, 0.2f};
  const auto expect = [&]<class T>(T /*type*/, double step) {
    GltfSample sample;
    constexpr bool kIsInteger = !std::is_same_v<T, float>;
    if constexpr (!std::is_signed_v<T> || !kIsInteger)
      sample.set("COLOR_0", stored<T>(rgb), "VEC3", kIsInteger);
    sample.set("TEXCOORD_0", stored<T>(uv), "VEC2", kIsInteger);
    if constexpr (kIsInteger && std::is_unsigned_v<T>)
      sample.primitive()["indices"] = sample.accessor(std::vector<T>{0, 1, 2, 0, 2, 3}, "SCALAR");
    const Model model = read_sample(sample);
    const Mesh& mesh = model.parts.at(0).mesh;
    ASSERT_EQ(mesh.uvs.size(), 4u);
    EXPECT_EQ(model.triangle_count(), 2u);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(mesh.uvs[i].x(), uv[2 * i], step);
      EXPECT_NEAR(mesh.uvs[i].y(), uv[2 * i + 1], step);
      for (std::size_t k = 0; k < 3 && !mesh.colors.empty(); ++k)
        EXPECT_NEAR(mesh.colors[i][static_cast<Eigen::Index>(k)], rgb[3 * i + k], step);
    }
  };
  expect(uint8_t{}, 0.5 / 255 + 1e-6);
  expect(uint16_t{}, 0.5 / 65535 + 1e-6);
  expect(int8_t{}, 0.5 / 127 + 1e-6);
  expect(int16_t{}, 0.5 / 32767 + 1e-6);
  expect(float{}, 1e-7);
  GltfSample wide;
  wide.primitive()["indices"] = wide.accessor(std::vector<uint32_t>{0, 1, 2, 0, 2, 3}, "SCALAR");
  EXPECT_EQ(read_sample(wide).triangle_count(), 2u);
}

TEST(GltfAccessors, InterleavedSparseAndMissingDataAreRead) {
  GltfSample interleaved;  // position and normal in turn
  const int view = interleaved.view(
      std::vector<float>{-2, -1, 0, 0, 0, 1, 2, -1, 0, 0, 0, 1, 2, 1, 0, 0, 0, 1, -2, 1, 0, 0, 0, 1}, 24);
  Json entry = {{"bufferView", view}, {"componentType", kFloat32}, {"count", 4}, {"type", "VEC3"}};
  interleaved.primitive()["attributes"]["POSITION"] = interleaved.add_accessor(entry);
  entry["byteOffset"] = 12;
  interleaved.primitive()["attributes"]["NORMAL"] = interleaved.add_accessor(entry);
  const Model model = read_sample(interleaved);
  expect_box(model, {-2, -1, 0}, {2, 1, 0});
  EXPECT_EQ(model.parts.at(0).mesh.normals.at(0), Vector3f(0, 0, 1));

  GltfSample sparse;  // vertex 2 moved to (3, 4, 0)
  const int at = sparse.view(std::vector<uint8_t>{2}), to = sparse.view(std::vector<float>{3, 4, 0});
  sparse.document["accessors"][0]["sparse"] = {{"count", 1},
                                               {"indices", {{"bufferView", at}, {"componentType", kUint8}}},
                                               {"values", {{"bufferView", to}}}};
  expect_box(read_sample(sparse), {-1, -1, 0}, {3, 4, 0});
}

TEST(GltfPrimitives, StripsFansAndBareVerticesAreTriangles) {
  GltfSample strip;
  strip.primitive()["mode"] = 5;
  strip.primitive()["indices"] = strip.accessor(std::vector<uint8_t>{0, 1, 3, 2}, "SCALAR");
  const Model strips = read_sample(strip);
  EXPECT_EQ(strips.triangle_count(), 2u);
  expect_facing_z(strips);

  GltfSample fan;
  fan.primitive()["mode"] = 6;
  fan.primitive()["indices"] = fan.accessor(std::vector<uint32_t>{0, 1, 2, 3}, "SCALAR");
  const Model fans = read_sample(fan);
  EXPECT_EQ(fans.triangle_count(), 2u);
  expect_facing_z(fans);

  GltfSample bare;
  bare.primitive().erase("indices");
  bare.primitive()["mode"] = 6;
  EXPECT_EQ(read_sample(bare).triangle_count(), 2u);
}

TEST(GltfPrimitives, PointsAndLinesAreLeftOutWithAWarning) {
  // Six indices are six points, three separate lines, a closed line of six parts, or an open one of five.
  for (const auto& [mode, line] : {std::pair(0, "6 points left out"),
                                   {1, "3 lines left out"},
                                   {2, "6 lines left out"},
                                   {3, "5 lines left out"}}) {
    GltfSample sample;
    Json other = sample.primitive();
    other["mode"] = mode;
    sample.document["meshes"][0]["primitives"].push_back(other);
    const Model model = read_sample(sample);
    EXPECT_EQ(model.triangle_count(), 2u);
    EXPECT_TRUE(warns(model, line)) << ::testing::PrintToString(model.warnings);
    sample.primitive()["mode"] = mode;
    EXPECT_NE(why_not(sample.text()).find("left out: only triangles are drawn"), std::string::npos);
  }
}

TEST(GltfPrimitives, FacesWithoutNormalsAreFlat) {
  GltfSample sample;  // a shallow roof, which a crease angle would smooth
  sample.primitive()["attributes"].erase("NORMAL");
  sample.set("POSITION", std::vector<float>{-1, -1, 0, 1, -1, 0.2f, 1, 1, 0, -1, 1, 0.2f}, "VEC3");
  const Model model = read_sample(sample);
  const Mesh& mesh = model.parts.at(0).mesh;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vector3f& a = mesh.positions[mesh.indices[i]];
    const Vector3f face =
        (mesh.positions[mesh.indices[i + 1]] - a).cross(mesh.positions[mesh.indices[i + 2]] - a).normalized();
    for (std::size_t k = 0; k < 3; ++k) EXPECT_LT((mesh.normals[mesh.indices[i + k]] - face).norm(), 1e-5f);
  }
}

TEST(GltfExtensions, RequiredOnesThatAreNotSupportedAreRefusedByName) {
  GltfSample sample;
  sample.document["extensionsRequired"] = sample.document["extensionsUsed"] = {"ACME_needed"};
  EXPECT_NE(why_not(sample.text()).find("ACME_needed"), std::string::npos) << why_not(sample.text());
  sample.document.erase("extensionsRequired");
  EXPECT_TRUE(warns(read_sample(sample), "ACME_needed"));
}

TEST(GltfExtensions, ContentThatIsNotDrawnIsNamed) {
  GltfSample sample;
  sample.document["cameras"] = {{{"type", "perspective"}}};
  sample.document["animations"] = {Json::object(), Json::object()};
  sample.document["extensions"]["KHR_lights_punctual"]["lights"] = {Json::object()};
  // Extensions that extensionsUsed does not list are found wherever they are, but not in data of
  // applications.
  sample.material()["extensions"]["KHR_materials_anisotropy"] = {{"anisotropyStrength", 1}};
  sample.document["nodes"][0]["extensions"]["ACME_node"] = Json::object();
  sample.primitive()["extensions"]["ACME_deep"]["extensions"]["ACME_deeper"] = 1;
  sample.primitive()["extras"]["extensions"]["ACME_private"] = Json::object();
  sample.set("COLOR_1", std::vector<float>(16, 1), "VEC4");
  const Model model = read_sample(sample);
  for (const char* name : {"2 animations", "1 cameras", "1 lights", "KHR_materials_anisotropy", "ACME_node",
                           "ACME_deep ", "COLOR_1"})
    EXPECT_TRUE(warns(model, name)) << name;
  for (const char* name : {"ACME_private", "KHR_lights_punctual"}) EXPECT_FALSE(warns(model, name)) << name;
}

/// The message about a texture whose only image needs a transcoder that Debian does not have.
TEST(GltfExtensions, BasisUniversalIsNamedAndItsFallbackIsDrawn) {
  GltfSample sample;
  sample.pbr()["baseColorTexture"] = {
      {"index", sample.texture(base64_bytes(
                    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR42mP4z8AAAAMBAQDJ/pLvAAAA"
                    "AElFTkSuQmCC"))}};
  Json& texture = sample.document["textures"][0];
  texture["extensions"]["KHR_texture_basisu"]["source"] = 0;
  const Model with_fallback = read_sample(sample);
  EXPECT_TRUE(warns(with_fallback, "KHR_texture_basisu"));
  EXPECT_EQ(with_fallback.textures.size(), 1u) << "the PNG";
  texture.erase("source");
  const Model without = read_sample(sample);
  EXPECT_TRUE(warns(without, "KHR_texture_basisu") && warns(without, "textures[0] is ignored"));
  EXPECT_TRUE(without.textures.empty());
  sample.document["extensionsUsed"] = sample.document["extensionsRequired"] = {"KHR_texture_basisu"};
  EXPECT_NE(why_not(sample.text()).find("KHR_texture_basisu"), std::string::npos);
}

TEST(GltfPlaces, OfCamerasAndLightsAreThoseOfTheirNodes) {
  GltfSample sample;
  Json& nodes = sample.document["nodes"];
  nodes[0]["translation"] = {1, 2, 3};
  nodes[0]["children"] = {1, 2};
  const Json light = {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}};
  nodes.push_back({{"name", "eye"}, {"camera", 0}, {"translation", {0, 0, 4}}});
  nodes.push_back(light);
  sample.document["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}}}}};
  Json& lights = sample.document["extensions"]["KHR_lights_punctual"]["lights"];
  lights = {{{"name", "bulb"}, {"type", "spot"}, {"intensity", 7}, {"color", {1, 0, 0.5}}, {"range", 20}}};
  const Model model = read_sample(sample);
  ASSERT_EQ(model.cameras.size(), 1u);
  EXPECT_EQ(model.cameras[0].name, "eye");
  EXPECT_EQ(Vector3f(model.cameras[0].model_from_place.block<3, 1>(0, 3)), Vector3f(1, 2, 7));
  EXPECT_NEAR(model.cameras[0].fov_deg, 57.29578f, 1e-4f);
  ASSERT_EQ(model.lights.size(), 1u);
  EXPECT_EQ(model.lights[0].name, "bulb") << "its node has no name";
  EXPECT_EQ(model.lights[0].color, Vector3f(1, 0, 0.5f));
  EXPECT_NEAR(model.lights[0].outer_deg, 45, 1e-4f) << "the default";
  EXPECT_EQ(model.lights[0].range_m, 20);

  const Json broken[] = {{{"type", "laser"}},
                         {{"type", "point"}, {"intensity", -1}},
                         {{"type", "spot"}, {"spot", {{"outerConeAngle", 2}}}},
                         {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.5}, {"outerConeAngle", 0.4}}}}};
  for (const Json& entry : broken) {
    lights[0] = entry;
    const Model without = read_sample(sample);
    EXPECT_TRUE(without.lights.empty() && warns(without, "lights[0]: its ")) << entry;
  }
  sample.document["cameras"][0]["perspective"]["yfov"] = 4;
  EXPECT_TRUE(warns(read_sample(sample), "cameras[0]: its yfov"));
  sample.document["cameras"][0]["perspective"]["yfov"] = "wide";
  EXPECT_NE(why_not(sample.text()).find("yfov: must be a number"), std::string::npos);
}

TEST(GltfNodes, InstancesAreDrawnAtTheirPlaces) {
  GltfSample sample;
  sample.document["extensionsUsed"] = sample.document["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const int places = sample.accessor(std::vector<float>{0, 0, 0, 10, 0, 0, 0, 20, 0}, "VEC3");
  const int sizes = sample.accessor(std::vector<float>{1, 1, 1, 2, 1, 1, 1, 3, 1}, "VEC3");
  sample.document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", places}, {"SCALE", sizes}};
  const Model model = read_sample(sample);
  EXPECT_EQ(model.triangle_count(), 6u);
  expect_box(model, {-1, -1, 0}, {12, 23, 0});
}

TEST(GltfNodes, NegativeScaleKeepsTheFrontInFront) {
  GltfSample sample;
  sample.document["nodes"][0]["scale"] = {-1, 1, 1};
  const Model model = read_sample(sample);
  expect_facing_z(model);
  for (const Vector3f& normal : model.parts.at(0).mesh.normals) EXPECT_GT(normal.z(), 0.99f);
}

TEST(GltfSkins, JointsMoveVerticesAndTheNodeDoesNot) {
  GltfSample sample;  // the right half follows a joint that is 3 m to the right and turned upside down
  sample.set("JOINTS_0", std::vector<uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, "VEC4");
  sample.set("WEIGHTS_0", std::vector<uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0},
             "VEC4", true);
  std::vector<float> inverse(32, 0.0f);
  for (std::size_t m : {0u, 16u})
    for (std::size_t k = 0; k < 4; ++k) inverse[m + 5 * k] = 1;
  inverse[16 + 12] = -1;  // the second joint was bound at x = 1
  sample.document["skins"] = {
      {{"joints", {1, 2}}, {"inverseBindMatrices", sample.accessor(inverse, "MAT4")}}};
  sample.document["nodes"] = {
      {{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}, {"scale", {50, 50, 50}}},
      {{"name", "still"}},
      {{"name", "bone"}, {"translation", {4, 0, 0}}, {"rotation", {1, 0, 0, 0}}}};
  sample.document["scenes"][0]["nodes"] = {0, 1, 2};
  const Mesh mesh = read_sample(sample).parts.at(0).mesh;
  const std::vector<Vector3f> expected = {{-1, -1, 0}, {4, 1, 0}, {4, -1, 0}, {-1, 1, 0}};
  ASSERT_EQ(mesh.positions.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((mesh.positions[i] - expected[i]).norm(), 1e-5f) << i;
  EXPECT_LT((mesh.normals[1] - Vector3f(0, 0, -1)).norm(), 1e-5f) << "normals turn with their joint";
}

TEST(GltfMorphs, DefaultWeightsApplyAndThoseOfTheNodeReplaceThem) {
  GltfSample sample;
  const int up = sample.accessor(std::vector<float>{0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 2, 0}, "VEC3");
  const int out = sample.accessor(std::vector<float>{0, 0, 0, 4, 0, 0, 4, 0, 0, 0, 0, 0}, "VEC3");
  sample.primitive()["targets"] = {{{"POSITION", up}}, {{"POSITION", out}}};
  sample.document["meshes"][0]["weights"] = {0.5, 0};
  expect_box(read_sample(sample), {-1, -1, 0}, {1, 2, 0});
  sample.document["nodes"][0]["weights"] = {0, 0.25};
  expect_box(read_sample(sample), {-1, -1, 0}, {2, 1, 0});
}

TEST(GltfPacked, DracoMeshoptAndWebpAreUnpackedOrRefusedByName) {
  const auto expect_square = [](GltfSample& sample, const char* extension, const char* library) {
    sample.document["extensionsUsed"] = sample.document["extensionsRequired"] = {extension};
    const std::string refusal = why_not(sample.text());
    if (refusal.empty()) {
      const Model model = read_sample(sample);
      expect_box(model, {-1, -1, 0}, {1, 1, 0}, 2e-3f);
      EXPECT_EQ(model.triangle_count(), 2u);
      EXPECT_TRUE(model.warnings.empty()) << model.warnings.front();
      expect_facing_z(model);
    } else {
      EXPECT_NE(refusal.find(library), std::string::npos) << refusal;
    }
  };
  GltfSample meshopt;
  meshopt.primitive()["attributes"].erase("NORMAL");
  meshopt.primitive()["attributes"].erase("TEXCOORD_0");
  const std::vector<uint8_t> vertices =
      base64_bytes("oAAAAAEzAAAA//8AAAABDAAAAP8AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAIC/AACAvwAAAAA=");
  const std::vector<uint8_t> indices = base64_bytes("4PAAAHaHVmd4qYZliWiYAWkAAA==");
  const auto compress = [&](int accessor, const std::vector<uint8_t>& data, const char* mode, int stride,
                            int count) {
    const int raw = meshopt.view(data);
    const Json place = meshopt.document["bufferViews"][static_cast<std::size_t>(raw)];
    Json& entry = meshopt.document["bufferViews"][static_cast<std::size_t>(raw)];
    entry["byteLength"] = stride * count;
    entry["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},
                                                      {"byteOffset", place["byteOffset"]},
                                                      {"byteLength", data.size()},
                                                      {"byteStride", stride},
                                                      {"mode", mode},
                                                      {"count", count}};
    meshopt.document["accessors"][static_cast<std::size_t>(accessor)]["bufferView"] = raw;
  };
  compress(0, vertices, "ATTRIBUTES", 12, 4);
  meshopt.primitive()["indices"] =
      meshopt.add_accessor({{"bufferView", 0}, {"componentType", kUint32}, {"count", 6}, {"type", "SCALAR"}});
  compress(meshopt.primitive()["indices"].get<int>(), indices, "TRIANGLES", 4, 6);
  expect_square(meshopt, "EXT_meshopt_compression", "libmeshoptimizer-dev");

  GltfSample draco;
  draco.primitive()["attributes"].erase("NORMAL");
  draco.primitive()["attributes"].erase("TEXCOORD_0");
  const int view =
      draco.view(base64_bytes("RFJBQ08CAgEBAAAABAIAAgAAAR//AREB/wAAAQAJAwAAAgEBAQADAwEwARADACiCmAAAAAAA/"
                              "wcAAAAAgL8AAIC/AAAAAAAAAEAL"));
  draco.primitive()["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view},
                                                                   {"attributes", {{"POSITION", 0}}}};
  draco.document["accessors"][0].erase("bufferView");
  expect_square(draco, "KHR_draco_mesh_compression", "libdraco-dev");

  GltfSample webp;
  webp.pbr()["baseColorTexture"] = {
      {"index", webp.texture(base64_bytes("UklGRh4AAABXRUJQVlA4TBEAAAAvAQAAAA8Q87//8x8OMqL/AQA="))}};
  webp.document["textures"][0].erase("source");
  webp.document["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 0;
  expect_square(webp, "EXT_texture_webp", "libwebp-dev");
  if (why_not(webp.text()).empty()) {
    EXPECT_EQ(read_sample(webp).textures.at(0).rgba, (std::vector<uint8_t>{255, 0, 0, 255, 0, 0, 255, 255}));
  }
}

// Each of these files has a wrong size, index or type. The reader must detect it: after a crash of its
// process, the message would be another one.
TEST(GltfHostile, WrongSizesAndIndicesAreFound) {
  const std::vector<std::pair<const char*, std::function<void(GltfSample&)>>> lies = {
      {"count", [](GltfSample& s) { s.document["accessors"][0]["count"] = 4000000000u; }},
      {"view length", [](GltfSample& s) { s.document["bufferViews"][0]["byteLength"] = 1e15; }},
      {"view offset", [](GltfSample& s) { s.document["bufferViews"][0]["byteOffset"] = 9007199254740990.0; }},
      {"accessor offset",
       [](GltfSample& s) { s.document["accessors"][0]["byteOffset"] = 9007199254740990.0; }},
      {"stride", [](GltfSample& s) { s.document["bufferViews"][0]["byteStride"] = 1; }},
      {"negative", [](GltfSample& s) { s.document["accessors"][0]["count"] = -1; }},
      {"fraction", [](GltfSample& s) { s.document["nodes"][0]["mesh"] = 0.5; }},
      {"mesh", [](GltfSample& s) { s.document["nodes"][0]["mesh"] = 7; }},
      {"material", [](GltfSample& s) { s.primitive()["material"] = 9; }},
      {"mode", [](GltfSample& s) { s.primitive()["mode"] = 7; }},
      {"type", [](GltfSample& s) { s.document["accessors"][0]["type"] = "VEC9"; }},
      {"component", [](GltfSample& s) { s.document["accessors"][0]["componentType"] = 5124; }},
      {"string", [](GltfSample& s) { s.document["nodes"] = "none"; }},
      {"object", [](GltfSample& s) { s.document["nodes"][0] = 3; }},
      {"child", [](GltfSample& s) { s.document["nodes"][0]["children"] = {12}; }},
      {"cycle", [](GltfSample& s) { s.document["nodes"][0]["children"] = {0}; }},
      {"two parents",
       [](GltfSample& s) {
         s.document["nodes"] = {{{"children", {2}}, {"mesh", 0}}, {{"children", {2}}}, Json::object()};
       }},
      {"attribute length",
       [](GltfSample& s) {
         s.set("NORMAL", std::vector<float>{0, 0, 1}, "VEC3");
       }},
      {"sparse index",
       [](GltfSample& s) {
         const int at = s.view(std::vector<uint32_t>{4000000000u}), to = s.view(std::vector<float>{0, 0, 0});
         s.document["accessors"][0]["sparse"] = {
             {"count", 1},
             {"indices", {{"bufferView", at}, {"componentType", kUint32}}},
             {"values", {{"bufferView", to}}}};
       }},
      {"texture",
       [](GltfSample& s) {
         s.pbr()["baseColorTexture"] = {{"index", 3}};
       }},
      {"joint",
       [](GltfSample& s) {
         s.document["skins"] = {{{"joints", {44}}}};
         s.document["nodes"][0]["skin"] = 0;
       }},
      {"instances",
       [](GltfSample& s) {
         const int a = s.accessor(std::vector<float>{0, 0, 0}, "VEC3"),
                   b = s.accessor(std::vector<float>{1, 1, 1, 1, 1, 1}, "VEC3");
         s.document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", a},
                                                                                          {"SCALE", b}};
       }},
      {"outside", [](GltfSample& s) {
         s.document["images"] = {{{"uri", "a"}}};
         s.primitive()["indices"] = -2;
       }}};
  for (const auto& [name, tell] : lies) {
    GltfSample sample;
    tell(sample);
    const std::string message = why_not(sample.text());
    EXPECT_NE(message, "") << name;
    EXPECT_EQ(message.find("crash"), std::string::npos) << name << ": " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << name;
  }
}

TEST(GltfVersions, ANumberIsVersionOne) {
  GltfSample sample;
  sample.document["asset"]["version"] = 1.0;
  EXPECT_EQ(why_not(sample.text()).find("version: must be a string"), std::string::npos)
      << why_not(sample.text());
}

TEST(GltfHostile, BrokenContainersAreRefused) {
  const auto word = [](uint32_t value) {
    std::string text(4, '\0');
    std::memcpy(text.data(), &value, 4);
    return text;
  };
  const std::string head = "glTF" + word(2) + word(1000);
  for (const std::string& text : {head, head + word(900) + "JSON{}", head + word(2) + "JSON{}",
                                  head + word(0xfffffff0) + word(0x4E4F534A) + "{}"}) {
    const std::string message = why_not(text, "a.glb");
    EXPECT_NE(message, "");
    EXPECT_EQ(message.find("crash"), std::string::npos) << message;
  }
  EXPECT_NE(why_not("{\"asset\": {\"version\": \"2.0\"").find("JSON"), std::string::npos);
  EXPECT_NE(why_not("[]"), "");
  EXPECT_NE(why_not(R"({"asset":{"version":"3.1"}})").find("3.1"), std::string::npos);
}

TEST(GltfHostile, EveryTruncationAndFlippedByteIsReadOrRefused) {
  const GltfSample sample;
  const std::string text = sample.text();
  for (std::size_t i = 0; i < 48; ++i) {
    std::string changed = text;
    changed[(i * 7919) % text.size()] = static_cast<char>('0' + i % 10);
    EXPECT_EQ(why_not(changed).find("crash"), std::string::npos) << i;
    EXPECT_EQ(why_not(text.substr(0, text.size() * i / 48)).find("crash"), std::string::npos) << i;
  }
}

}  // namespace
}  // namespace offstage::render
