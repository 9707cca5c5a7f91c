#include <cstring>

#include <gtest/gtest.h>
#include <sys/mman.h>

#include "render/error.h"
#include "render/file_io.h"
#include "render/mesh_import.h"

namespace offstage::render {
namespace {

Model small_model() {
  Model model;
  model.materials = {{.name = "red", .base_color_texture = {.image = 0}},
                     {.name = "plain", .two_sided = true}};
  model.textures = {{.width_px = 2, .height_px = 1, .rgba = {1, 2, 3, 4, 5, 6, 7, 8}}};
  model.nodes = {{.name = "root"}, {.name = "arm", .parent = 0, .position = {1, 2, 3}}};
  model.parts = {
      {.mesh = {.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .indices = {0, 1, 2}}, .material = 1}};
  model.warnings = {"a line"};
  return model;
}

std::vector<uint8_t> encoded(Model model) {
  const Descriptor memory(::memfd_create("test", MFD_CLOEXEC));
  write_model(model, memory.fd());
  std::vector<uint8_t> bytes(static_cast<std::size_t>(::lseek(memory.fd(), 0, SEEK_END)));
  EXPECT_EQ(::pread(memory.fd(), bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
  return bytes;
}

bool is_refused(Model model) {
  try {
    decode_model(encoded(std::move(model)));
    return false;
  } catch (const FileError&) {
    return true;
  }
}

TEST(ModelAnswer, ComesBackUnchanged) {
  const Model model = small_model(), back = decode_model(encoded(model));
  ASSERT_EQ(back.parts.size(), 1u);
  EXPECT_EQ(back.parts[0].material, 1);
  EXPECT_EQ(back.parts[0].mesh.positions, model.parts[0].mesh.positions);
  EXPECT_EQ(back.parts[0].mesh.indices, model.parts[0].mesh.indices);
  ASSERT_EQ(back.nodes.size(), 2u);
  EXPECT_EQ(back.nodes[1].name, "arm");
  EXPECT_EQ(back.nodes[1].parent, 0);
  ASSERT_EQ(back.materials.size(), 2u);
  EXPECT_TRUE(back.materials[1].two_sided);
  ASSERT_EQ(back.textures.size(), 1u);
  EXPECT_EQ(back.textures[0].rgba, model.textures[0].rgba);
  EXPECT_EQ(back.warnings, model.warnings);
}

TEST(ModelAnswer, WithReferencesToMissingObjectsIsRefused) {
  const auto refused_with = [](auto change) {
    Model model = small_model();
    change(model);
    return is_refused(std::move(model));
  };
  EXPECT_TRUE(refused_with([](Model& m) { m.parts[0].material = 2; }));
  EXPECT_TRUE(refused_with([](Model& m) { m.parts[0].material = -1; }));
  EXPECT_TRUE(refused_with([](Model& m) { m.parts[0].mesh.indices[2] = 3; }));
  EXPECT_TRUE(refused_with([](Model& m) { m.parts[0].mesh.indices.pop_back(); }));
  EXPECT_TRUE(refused_with([](Model& m) { m.parts[0].mesh.uvs.resize(2); }));
  EXPECT_TRUE(refused_with([](Model& m) { m.parts[0].mesh.normals.resize(4); }));
  EXPECT_TRUE(refused_with([](Model& m) { m.parts[0].mesh.positions[0].x() = NAN; }));
  EXPECT_TRUE(refused_with([](Model& m) { m.nodes[0].parent = 0; })) << "its own parent";
  EXPECT_TRUE(refused_with([](Model& m) { m.nodes[1].parent = -2; }));
  EXPECT_TRUE(refused_with([](Model& m) { m.materials[0].emission_texture.image = 1; }));
  EXPECT_TRUE(refused_with([](Model& m) { m.materials[1].specular_texture.image = -2; }));
  EXPECT_TRUE(refused_with([](Model& m) { m.materials[0].normal_texture.wrap_v = static_cast<Wrap>(3); }));
  EXPECT_TRUE(refused_with([](Model& m) { m.parts[0].mesh.colors.resize(2); }));
  EXPECT_TRUE(refused_with([](Model& m) { m.textures[0].height_px = 2; }));
  EXPECT_TRUE(refused_with([](Model& m) { m.textures[0].width_px = -2; }));
}

// 2^16 * 2^16 * 4 is 0 modulo 2^34; sizes are multiplied in 64 bits.
TEST(ModelAnswer, SizesThatOverflowAreRefused) {
  Model model = small_model();
  model.textures[0] = {.width_px = 1 << 30, .height_px = 1 << 30, .rgba = {}};
  EXPECT_TRUE(is_refused(std::move(model)));
}

TEST(ModelAnswer, OfAnyOtherBytesIsRefusedOrConsistent) {
  const std::vector<uint8_t> whole = encoded(small_model());
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_THROW(decode_model({whole.data(), size}), FileError) << size;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int value : {0, 1, 2, 0x7f, 0x80, 0xff}) {
      std::vector<uint8_t> bytes = whole;
      bytes[at] = static_cast<uint8_t>(value);
      try {
        Model model = decode_model(bytes);
        for (Model::Part& part : model.parts) {
          ASSERT_LT(static_cast<std::size_t>(part.material), model.materials.size()) << at;
          compute_normals(part.mesh);
        }
      } catch (const FileError&) {
      }
    }
  }
}

}  // namespace
}  // namespace offstage::render
