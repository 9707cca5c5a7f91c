#include "render/mesh_io.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "render/error.h"
#include "render/image_io.h"
#include "scratch.h"

namespace offstage::render {
namespace {

const char kTriangle[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const char kTetrahedron[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

template <class T>
std::string base64(const std::vector<T>& values) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* bytes = reinterpret_cast<const uint8_t*>(values.data());
  const std::size_t size = values.size() * sizeof(T);
  std::string text;
  for (std::size_t i = 0; i < size; i += 3) {
    const uint32_t a = bytes[i], b = i + 1 < size ? bytes[i + 1] : 0u, c = i + 2 < size ? bytes[i + 2] : 0u;
    const uint32_t word = a << 16 | b << 8 | c;
    for (uint32_t k = 0; k < 4; ++k) text += i + k <= size ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// Returns a glTF file with one triangle (0,0,0) (1,0,0) (0,1,0) and texture coordinates equal to x, y.
/// `more` are further members of the document, `nodes` its nodes, the first of which is the scene's.
std::string gltf(const std::string& nodes = R"([{"mesh":0}])", const std::string& more = "") {
  const std::vector<float> data = {0, 0, 0, 1, 0, 0, 0, 1, 0, /*uv*/ 0, 0, 1, 0, 0, 1};
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" + nodes +
         R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
             "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
                          {"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}],
             "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":24}],
             "buffers":[{"byteLength":60,"uri":"data:application/octet-stream;base64,)" +
         base64(data) + "\"}]" + more + "}";
}

double signed_volume(const Mesh& mesh) {
  double volume = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const auto at = [&](std::size_t k) -> const Vector3f& { return mesh.positions[mesh.indices[i + k]]; };
    volume += at(0).dot(at(1).cross(at(2))) / 6;
  }
  return volume;
}

/// Returns the part's only vertex at a position.
std::size_t vertex_at(const Mesh& mesh, const Vector3f& position) {
  const auto found = std::find_if(mesh.positions.begin(), mesh.positions.end(),
                                  [&](const Vector3f& p) { return (p - position).norm() < 1e-6f; });
  if (found == mesh.positions.end()) throw std::runtime_error("no such vertex");
  return static_cast<std::size_t>(found - mesh.positions.begin());
}

std::string refusal(const std::filesystem::path& path) {
  return message_of<FileError>([&] { read_model(path); });
}

TEST(ReadModel, JoinsTheVerticesOfNeighbouringFaces) {
  const ScratchFolder folder;
  // One smoothing group and a crease of 40 degrees: a flat square needs four vertices.
  const Model model = read_model(folder.put("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"));
  ASSERT_EQ(model.parts.size(), 1u);
  EXPECT_EQ(model.triangle_count(), 2u);
  EXPECT_EQ(model.vertex_count(), 4u);
  EXPECT_TRUE(model.warnings.empty());
}

TEST(ReadModel, GivesFlatFacesToACubeWithoutNormals) {
  const ScratchFolder folder;
  const Model model =
      read_model(folder.put("cube.off",
                            "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
                            "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 2 3 7 6\n4 1 2 6 5\n4 3 0 4 7\n"));
  const Mesh& mesh = model.parts.at(0).mesh;
  EXPECT_NEAR(signed_volume(mesh), 1, 1e-6);
  EXPECT_EQ(mesh.positions.size(), 24u);
  for (const Vector3f& normal : mesh.normals) EXPECT_NEAR(normal.cwiseAbs().maxCoeff(), 1, 1e-6f);
}

TEST(ReadModel, CutsPolygonsWithoutSliversAndGaps) {
  // Prisms of combs with collinear corners, where the ears of assimp have no area.
  const ScratchFolder folder;
  for (const int teeth : {1, 2, 5, 100}) {
    std::vector<std::pair<int, int>> outline = {{0, 0}, {2 * teeth, 0}, {2 * teeth, 1}};
    for (int i = teeth - 1; i >= 0; --i)
      outline.insert(outline.end(), {{2 * i + 1, 1}, {2 * i + 1, 2}, {2 * i, 2}, {2 * i, 1}});
    const std::size_t n = outline.size();
    std::string obj, bottom = "f", top = "f", sides;
    for (int z = 0; z < 2; ++z)
      for (const auto& [x, y] : outline)
        obj += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
    for (std::size_t i = 0; i < n; ++i) {
      bottom += " " + std::to_string(n - i);
      top += " " + std::to_string(n + 1 + i);
      const std::size_t j = (i + 1) % n;
      sides += "f " + std::to_string(i + 1) + " " + std::to_string(j + 1) + " " + std::to_string(n + j + 1) +
               " " + std::to_string(n + i + 1) + "\n";
    }
    const Model model = read_model(folder.put("comb.obj", obj + bottom + "\n" + top + "\n" + sides));
    const Mesh& mesh = model.parts.at(0).mesh;
    EXPECT_EQ(mesh.indices.size() / 3, 2 * (n - 2) + 2 * n);
    EXPECT_NEAR(signed_volume(mesh), 3 * teeth, 1e-4 * teeth);
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const auto at = [&](std::size_t k) -> const Vector3f& { return mesh.positions[mesh.indices[i + k]]; };
      EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).norm(), 0.1f);
    }
  }
}

TEST(ReadModel, CutsAFileOfPolygonsAlone) {
  const ScratchFolder folder;
  const Model model =
      read_model(folder.put("arrow.obj", "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 1 0\nv 0 2 0\nf 1 2 3 4 5\n"));
  EXPECT_EQ(model.parts.at(0).mesh.indices.size(), 9u);
}

TEST(ReadModel, PlacesInstancesByTheirNodes) {
  const ScratchFolder folder;
  const Model model = read_model(
      folder.put("a.gltf", gltf(R"([{"children":[1,2],"translation":[10,0,0]},{"mesh":0,"scale":[2,3,4]},
                         {"mesh":0,"rotation":[0,0,0.70710678,0.70710678]}])",
                                R"(,"materials":[{}])")));
  ASSERT_EQ(model.parts.size(), 1u) << "instances of one material are one part";
  EXPECT_EQ(model.triangle_count(), 2u);
  EXPECT_TRUE(model.bounds().min().isApprox(Vector3f(9, 0, 0), 1e-6f)) << model.bounds().min().transpose();
  EXPECT_TRUE(model.bounds().max().isApprox(Vector3f(12, 3, 0), 1e-6f)) << model.bounds().max().transpose();
}

TEST(ReadModel, ListsTheNodesWithTrianglesAndReadsOneOfThem) {
  const ScratchFolder folder;
  const std::filesystem::path file =
      folder.put("a.gltf", gltf(R"([{"name":"root","children":[1],"translation":[10,0,0]},
                         {"name":"arm","mesh":0,"scale":[2,2,2],"translation":[0,1,0],"children":[2]},
                         {"children":[3],"translation":[1,0,0]},
                         {"name":"arm","mesh":0,"rotation":[0,0,0.70710678,0.70710678]}])",
                                R"(,"materials":[{}])"));
  const Model whole = read_model(file);
  ASSERT_EQ(whole.nodes.size(), 2u);
  EXPECT_EQ(whole.nodes[0].name, "arm");
  EXPECT_EQ(whole.nodes[0].parent, -1);
  EXPECT_TRUE(whole.nodes[0].position.isApprox(Vector3f(10, 1, 0), 1e-6f));
  EXPECT_TRUE(whole.nodes[0].orientation.isApprox(Eigen::Quaternionf::Identity(), 1e-6f));
  EXPECT_EQ(whole.nodes[1].name, "arm_2");
  EXPECT_EQ(whole.nodes[1].parent, 0);
  EXPECT_TRUE(whole.nodes[1].position.isApprox(Vector3f(12, 1, 0), 1e-6f));
  EXPECT_TRUE((whole.nodes[1].orientation * Vector3f::UnitX()).isApprox(Vector3f::UnitY(), 1e-5f));

  // A node by itself: only its triangle, in the frame of the node, in the same size as in the whole model.
  const Model arm = read_model(file.string() + "#arm_2");
  EXPECT_EQ(arm.triangle_count(), 1u);
  EXPECT_TRUE(arm.bounds().min().isApprox(Vector3f(0, 0, 0), 1e-5f)) << arm.bounds().min().transpose();
  EXPECT_TRUE(arm.bounds().max().isApprox(Vector3f(2, 2, 0), 1e-5f)) << arm.bounds().max().transpose();
  EXPECT_THROW(read_model(file.string() + "#leg"), FileError);
}

TEST(ReadModel, KeepsTheOutsideOutsideUnderAMirror) {
  const ScratchFolder folder;
  const std::string dae_head =
      R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">)"
      R"(<asset><unit meter="0.5"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>)"
      R"(<source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common>)"
      R"(<accessor source="#a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>)"
      R"(<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input )"
      R"(semantic="POSITION" source="#p"/></vertices><triangles count="4"><input semantic="VERTEX" source="#v" )"
      R"(offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>)"
      R"(<library_visual_scenes><visual_scene id="s"><node>)";
  const std::string dae_tail =
      R"(<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>)"
      R"(<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
  for (const char* scale : {"1 1 2", "-1 1 2"}) {
    const Model model = read_model(folder.put("a.dae", dae_head + "<scale>" + scale + "</scale>" + dae_tail));
    EXPECT_NEAR(signed_volume(model.parts.at(0).mesh), 2 / 6.0 / 8, 1e-6) << scale;
    EXPECT_NEAR(model.bounds().max().y(), 1, 1e-6f) << "Z up in the file is Y up here, half a metre the unit";
  }
}

TEST(ReadModel, TextureCoordinatesStartAtTheImagesTopLeftInEveryFormat) {
  const ScratchFolder folder;
  const Model up =
      read_model(folder.put("a.obj", kTriangle + std::string("vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")));
  const Model down = read_model(folder.put("a.gltf", gltf(R"([{"mesh":0}])", R"(,"materials":[{}])")));
  const Mesh &obj = up.parts.at(0).mesh, &gltf_mesh = down.parts.at(0).mesh;
  EXPECT_TRUE(obj.uvs.at(vertex_at(obj, {0, 1, 0})).isApprox(Vector2f(0, 0))) << "OBJ counts from the bottom";
  EXPECT_TRUE(obj.uvs.at(vertex_at(obj, {1, 0, 0})).isApprox(Vector2f(1, 1)));
  EXPECT_TRUE(gltf_mesh.uvs.at(vertex_at(gltf_mesh, {0, 1, 0})).isApprox(Vector2f(0, 1)))
      << "glTF from the top";
}

TEST(ReadModel, TakesPhysicallyBasedFactorsAsTheyAre) {
  const ScratchFolder folder;
  const std::string factors = R"(,"materials":[{"name":"m","doubleSided":true,"emissiveFactor":[0.1,0.2,0.3],
      "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,0.5],"metallicFactor":0.75,"roughnessFactor":0.3})";
  const Model blend =
      read_model(folder.put("b.gltf", gltf(R"([{"mesh":0}])", factors + R"(,"alphaMode":"BLEND"}])")));
  const Material& material = blend.materials.at(static_cast<std::size_t>(blend.parts.at(0).material));
  EXPECT_EQ(material.name, "m");
  EXPECT_TRUE(material.color.isApprox(Vector4f(0.5f, 0.25f, 0.125f, 0.5f)));
  EXPECT_FLOAT_EQ(material.metallic, 0.75f);
  EXPECT_FLOAT_EQ(material.roughness, 0.3f);
  EXPECT_TRUE(material.emission.isApprox(Vector3f(0.1f, 0.2f, 0.3f)));
  EXPECT_TRUE(material.two_sided);
  const Model opaque = read_model(folder.put("o.gltf", gltf(R"([{"mesh":0}])", factors + "}]")));
  EXPECT_EQ(opaque.materials.at(0).color.w(), 1) << "the default alpha mode ignores alpha";
}

TEST(ReadModel, TurnsAClassicHighlightIntoRoughnessAndScreenColoursIntoLight) {
  const ScratchFolder folder;
  folder.put("a.mtl",
             "newmtl shiny\nKd 0.5 0 1\nKs 1 1 1\nNs 98\nd 0.25\nnewmtl matt\nKd 1 1 1\nKs 0 0 0\nNs 98\n");
  const Model model = read_model(folder.put(
      "a.obj",
      "mtllib a.mtl\n" + std::string(kTetrahedron).insert(32, "usemtl matt\n") + "usemtl shiny\nf 1 2 3\n"));
  const auto material = [&](const char* name) -> const Material& {
    return *std::find_if(model.materials.begin(), model.materials.end(),
                         [&](const Material& m) { return m.name == name; });
  };
  EXPECT_EQ(model.parts.size(), 2u);
  EXPECT_NEAR(material("shiny").roughness, std::pow(2 / 100.0, 0.25), 1e-6);
  EXPECT_NEAR(material("matt").roughness, 1, 1e-6);
  EXPECT_NEAR(material("shiny").color.x(), std::pow((0.5 + 0.055) / 1.055, 2.4), 1e-5);
  EXPECT_FLOAT_EQ(material("shiny").color.w(), 0.25f);
}

TEST(ReadModel, FindsTexturesOfOtherMachinesBesideTheModel) {
  const ScratchFolder folder;
  const Image image{2, 1, {10, 20, 30, 255, 40, 50, 60, 255}};
  write_png(folder / "Wall Paper.png", image);
  folder.put("a.mtl", "newmtl m\nKd 1 1 1\nmap_Kd C:\\art\\textures\\wall paper.PNG\n");
  const Model model =
      read_model(folder.put("a.obj", "mtllib a.mtl\n" + std::string(kTriangle) +
                                         "vt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"));
  EXPECT_TRUE(model.warnings.empty()) << model.warnings.front();
  ASSERT_EQ(model.textures.size(), 1u);
  EXPECT_EQ(model.textures[0].rgba, image.rgba);
  EXPECT_EQ(model.materials.at(static_cast<std::size_t>(model.parts.at(0).material)).base_color_texture.image,
            0);
}

TEST(ReadModel, NamesMissingMaterialsOfObjFiles) {
  const ScratchFolder folder;
  const auto warnings = [&](const std::string& head) {
    return read_model(folder.put("a.obj", head + std::string(kTriangle) + "usemtl gold\nf 1 2 3\n")).warnings;
  };
  EXPECT_EQ(warnings("mtllib gone.mtl\n"),
            std::vector<std::string>{
                "the material library 'gone.mtl' is not found; its materials have the default appearance"});
  folder.put("there.mtl", "newmtl silver\nKd 1 1 1\n");
  EXPECT_EQ(warnings("mtllib there.mtl\n"),
            std::vector<std::string>{
                "the material 'gold' is in no material library; it has the default appearance"});
  EXPECT_TRUE(warnings("").empty()) << "files without a library may name materials";
}

TEST(ReadModel, ReadsEmbeddedTexturesOnceAndDropsAlphaThatIsNotMeant) {
  const ScratchFolder folder;
  const Image image{1, 1, {10, 20, 30, 40}};
  const Model model = read_model(folder.put(
      "a.gltf",
      gltf(R"([{"mesh":0}])", R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},
          "metallicRoughnessTexture":{"index":0}},"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}}],
          "textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,)" +
                                  base64(encode_png(image)) + "\"}]")));
  const Material& material = model.materials.at(0);
  ASSERT_EQ(model.textures.size(), 1u);
  EXPECT_EQ(model.textures[0].rgba, (std::vector<uint8_t>{10, 20, 30, 255}));
  EXPECT_EQ(material.base_color_texture.image, 0);
  EXPECT_EQ(material.metallic_roughness_texture.image, 0);
  EXPECT_EQ(material.emission_texture.image, 0);
}

TEST(ReadModel, WarnsOnceOfATextureThatIsNotThere) {
  const ScratchFolder folder;
  folder.put("a.mtl", "newmtl m\nmap_Kd none.png\nnewmtl n\nmap_Kd none.png\n");
  const Model model =
      read_model(folder.put("a.obj", "mtllib a.mtl\n" + std::string(kTriangle) + "usemtl m\nf 1 2 3\n"));
  EXPECT_EQ(model.warnings, std::vector<std::string>{"texture 'none.png' does not exist"});
  EXPECT_EQ(model.materials.at(static_cast<std::size_t>(model.parts.at(0).material)).base_color_texture.image,
            -1);
}

TEST(ReadModel, SkipsElementsThatCannotBeDrawnWithAWarning) {
  const ScratchFolder folder;
  const Model model = read_model(folder.put(
      "a.obj", std::string(kTetrahedron) + "v nan 0 0\nv 2 0 0\nf 5 1 2\nf 1 2 6\nf 1 1 2\nl 1 2\n"));
  EXPECT_EQ(model.triangle_count(), 4u);
  EXPECT_NEAR(signed_volume(model.parts.at(0).mesh), 1 / 6.0, 1e-6);
  EXPECT_LE(model.bounds().max().maxCoeff(), 1) << "unused vertices are gone";
  std::string all;
  for (const std::string& line : model.warnings) all += line + "\n";
  EXPECT_NE(all.find("1 faces left out: a vertex is not finite"), std::string::npos) << all;
  EXPECT_NE(all.find("faces left out: they have no area"), std::string::npos) << all;
  EXPECT_NE(all.find("left out: only triangles are drawn"), std::string::npos) << all;
}

/// A red triangle with a texture of its specular colour, a camera, a light, and an animation.
const char kFullCollada[] = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>
<unit name="centimeter" meter="0.01"/>
<up_axis>Y_UP</up_axis>
</asset>
<library_cameras>
<camera id="c">
<optics>
<technique_common>
<perspective>
<yfov>40</yfov>
<aspect_ratio>1</aspect_ratio>
<znear>0.1</znear>
<zfar>10</zfar>
</perspective>
</technique_common>
</optics>
</camera>
</library_cameras>
<library_lights>
<light id="l">
<technique_common>
<point>
<color>1 1 1</color>
</point>
</technique_common>
</light>
</library_lights>
<library_images>
<image id="i">
<init_from>shine.png</init_from>
</image>
</library_images>
<library_effects>
<effect id="e">
<profile_COMMON>
<newparam sid="su">
<surface type="2D">
<init_from>i</init_from>
</surface>
</newparam>
<newparam sid="sa">
<sampler2D>
<source>su</source>
</sampler2D>
</newparam>
<technique sid="t">
<phong>
<diffuse>
<color>1 0 0 1</color>
</diffuse>
<specular>
<texture texture="sa" texcoord="UV"/>
</specular>
</phong>
</technique>
</profile_COMMON>
</effect>
</library_effects>
<library_materials>
<material id="m" name="m">
<instance_effect url="#e"/>
</material>
</library_materials>
<library_geometries>
<geometry id="g">
<mesh>
<source id="p">
<float_array id="pa" count="9">0 0 0 100 0 0 0 100 0</float_array>
<technique_common>
<accessor source="#pa" count="3" stride="3">
<param name="X" type="float"/>
<param name="Y" type="float"/>
<param name="Z" type="float"/>
</accessor>
</technique_common>
</source>
<vertices id="v">
<input semantic="POSITION" source="#p"/>
</vertices>
<triangles count="1" material="s">
<input semantic="VERTEX" source="#v" offset="0"/>
<p>0 1 2</p>
</triangles>
</mesh>
</geometry>
</library_geometries>
<library_animations>
<animation id="a">
<source id="ai">
<float_array id="aia" count="2">0 1</float_array>
<technique_common>
<accessor source="#aia" count="2" stride="1">
<param name="TIME" type="float"/>
</accessor>
</technique_common>
</source>
<source id="ao">
<float_array id="aoa" count="2">0 1</float_array>
<technique_common>
<accessor source="#aoa" count="2" stride="1">
<param name="X" type="float"/>
</accessor>
</technique_common>
</source>
<source id="an">
<Name_array id="ana" count="2">LINEAR LINEAR</Name_array>
<technique_common>
<accessor source="#ana" count="2" stride="1">
<param name="INTERPOLATION" type="name"/>
</accessor>
</technique_common>
</source>
<sampler id="as">
<input semantic="INPUT" source="#ai"/>
<input semantic="OUTPUT" source="#ao"/>
<input semantic="INTERPOLATION" source="#an"/>
</sampler>
<channel source="#as" target="n/t.X"/>
</animation>
</library_animations>
<library_visual_scenes>
<visual_scene id="s">
<node id="n">
<translate sid="t">0 0 0</translate>
<instance_geometry url="#g">
<bind_material>
<technique_common>
<instance_material symbol="s" target="#m"/>
</technique_common>
</bind_material>
</instance_geometry>
</node>
<node id="cn">
<instance_camera url="#c"/>
</node>
<node id="ln">
<instance_light url="#l"/>
</node>
</visual_scene>
</library_visual_scenes>
<scene>
<instance_visual_scene url="#s"/>
</scene>
</COLLADA>)";

TEST(ReadModel, NamesIgnoredFeaturesOfOtherFormats) {
  const ScratchFolder folder;
  const Model model = read_model(folder.put("a.dae", kFullCollada));
  EXPECT_EQ(model.triangle_count(), 1u);
  std::string all;
  for (const std::string& line : model.warnings) all += line + "\n";
  for (const char* what : {"1 animations are ignored", "1 cameras are ignored", "1 lights are ignored",
                           "material 'm': its specular map is ignored"})
    EXPECT_NE(all.find(what), std::string::npos) << what << " in " << all;
}

TEST(ReadModel, RefusesInOneLine) {
  const ScratchFolder folder;
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  };
  expect(refusal(folder / "none.obj"), "there is no such file");
  expect(refusal(folder.path()), "not a regular file");
  expect(refusal(folder.put("empty.obj", "")), "is empty");
  expect(refusal(folder.put("a.xyz", "no model at all")), "its format is not supported");
  expect(refusal(folder.put("index.obj", std::string(kTriangle) + "f 1 2 9\n")), "out of range");
  expect(refusal(folder.put("points.obj", std::string(kTriangle) + "p 1\np 2\np 3\n")), "holds no triangle");
  expect(refusal(folder.put("recursive.gltf", gltf(R"([{"children":[0]}])", R"(,"materials":[{}])"))),
         "recursive");
}

// Files that end assimp's process: nested deeper than its stack, or claiming counts that no memory holds.
TEST(ReadModel, SurvivesFilesThatCrashTheReader) {
  const ScratchFolder folder;
  std::string chain = "[";
  for (int i = 1; i < 200000; ++i) chain += "{\"children\":[" + std::to_string(i) + "]},";
  EXPECT_EQ(read_model(folder.put("deep.gltf", gltf(chain + R"({"mesh":0}])", R"(,"materials":[{}])")))
                .triangle_count(),
            1u)
      << "glTF is read without recursion";
  std::string nested;
  for (int i = 0; i < 100000; ++i) nested += "OBJECT group\nkids 1\n";
  EXPECT_NE(refusal(folder.put("deep.ac",
                               "AC3Db\nMATERIAL \"\" rgb 1 1 1  amb 0 0 0  emis 0 0 0  spec 0 0 0  shi 1  "
                               "trans 0\n" +
                                   nested + "OBJECT poly\nkids 0\n")),
            "");
  EXPECT_NE(refusal(folder.put("count.off", "OFF\n3 1000000000 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")), "");
  EXPECT_EQ(read_model(folder.put("good.obj", kTetrahedron)).triangle_count(), 4u)
      << "the reader still works";
}

TEST(ReadModel, GivesTheSameModelEveryTime) {
  const std::filesystem::path path = std::filesystem::path(OFFSTAGE_SOURCE_DIR) / "assets/models/duck.glb";
  const Model a = read_model(path), b = read_model(path);
  ASSERT_EQ(a.parts.size(), b.parts.size());
  for (std::size_t i = 0; i < a.parts.size(); ++i) {
    EXPECT_EQ(a.parts[i].mesh.indices, b.parts[i].mesh.indices);
    ASSERT_EQ(a.parts[i].mesh.positions.size(), b.parts[i].mesh.positions.size());
    EXPECT_EQ(0, std::memcmp(a.parts[i].mesh.positions.data(), b.parts[i].mesh.positions.data(),
                             a.parts[i].mesh.positions.size() * sizeof(Vector3f)));
  }
}

TEST(GalleryModels, AllLoadWithoutAWarning) {
  int count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(OFFSTAGE_SOURCE_DIR) / "assets/models")) {
    if (entry.path().extension() == ".mtl") continue;
    const Model model = read_model(entry.path(), {}, {}, true);
    EXPECT_TRUE(model.warnings.empty()) << entry.path() << ": " << model.warnings.front();
    EXPECT_LE(std::filesystem::file_size(entry), 1200000u) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 15);
}

}  // namespace
}  // namespace offstage::render
