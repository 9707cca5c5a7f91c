// Values written to an EXR file are read back unchanged.

#include <cmath>
#include <limits>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStringAttribute.h>
#include <gtest/gtest.h>

#include "render/channels.h"
#include "tests/render/scratch.h"

namespace offstage::render {
namespace {

Channels exr_sample() {
  Channels c{.width_px = 3, .height_px = 2, .depth = {}, .normal = {}, .id = {}, .motion = {}};
  for (uint32_t i = 0; i < 6; ++i) {
    const auto x = static_cast<float>(i);
    c.depth.push_back(i == 2 ? std::numeric_limits<float>::infinity() : 1.5f + x);
    c.normal.push_back({0.1f * x, 0.2f * x, -0.3f * x});
    c.id.push_back(16'000'000 + i);
    c.motion.push_back({-x, 0.25f * x});
  }
  return c;
}

template <class T>
std::vector<T> read(const std::filesystem::path& path, const char* name, Imf::PixelType type) {
  Imf::InputFile file(path.c_str());
  std::vector<T> values(6);
  Imf::FrameBuffer pixels;
  pixels.insert(name, Imf::Slice(type, reinterpret_cast<char*>(values.data()), sizeof(T), 3 * sizeof(T)));
  file.setFrameBuffer(pixels);
  file.readPixels(0, 1);
  return values;
}

TEST(Exr, KeepsEveryNumber) {
  const ScratchFolder folder;
  const Channels c = exr_sample();
  write_exr(folder / "a.exr", c, {{Channel::depth, Channel::normal, Channel::id, Channel::motion}},
            {{16'000'001, "the box"}});
  EXPECT_EQ(read<float>(folder / "a.exr", "Z", Imf::FLOAT), c.depth);
  EXPECT_EQ(read<uint32_t>(folder / "a.exr", "id", Imf::UINT), c.id);
  const auto y = read<float>(folder / "a.exr", "N.Y", Imf::FLOAT),
             my = read<float>(folder / "a.exr", "motion.Y", Imf::FLOAT);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(y[i], c.normal[i].y());
    EXPECT_EQ(my[i], c.motion[i].y());
  }
  Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_EQ(file.header().typedAttribute<Imf::StringAttribute>("objects").value(), "16000001 the box\n");
}

TEST(Exr, ContainsOnlyTheChosenChannels) {
  const ScratchFolder folder;
  write_exr(folder / "a.exr", exr_sample(), {{Channel::motion}}, {});
  Imf::InputFile file((folder / "a.exr").c_str());
  std::vector<std::string> names;
  for (auto i = file.header().channels().begin(); i != file.header().channels().end(); ++i)
    names.push_back(i.name());
  EXPECT_EQ(names, (std::vector<std::string>{"motion.X", "motion.Y"}));
}

}  // namespace
}  // namespace offstage::render
