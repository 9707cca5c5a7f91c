#include "render/context.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "render/error.h"
#include "render/gl_platform.h"
#include "render/tone_map.h"
#include "tests/render/gl_fixture.h"

namespace offstage::render {
namespace {

constexpr const char* kThreadsVariable = "OFFSTAGE_TEST_RASTER_THREADS";

// Sets the environment before any test creates a context.
class PinnedEnvironment : public ::testing::Environment {
  void SetUp() override {
    const char* threads = std::getenv(kThreadsVariable);
    pin_environment(threads != nullptr ? std::atoi(threads) : 1);
  }
};
const ::testing::Environment* const kPinned = ::testing::AddGlobalTestEnvironment(new PinnedEnvironment);

// Draws a scene that uses every pass, with sample offsets, and returns the hash of its displayed pixels.
std::string hash_of_a_rich_scene(Context& context) {
  Stage stage(context, {.width_px = 160, .height_px = 90});
  const MaterialHandle brick = stage.add_material({.pattern = Pattern::brick});
  const MaterialHandle checker = stage.add_material({.pattern = Pattern::checker});
  const MaterialHandle glass = stage.add_material({.color = {0.2f, 0.5f, 0.7f, 0.4f}, .roughness = 0.1f});
  stage.add_instance(stage.add_mesh(make_ground(500)), checker);
  stage.add_instance(stage.add_mesh(make_box({1, 1, 1}, 0.05f)), brick);
  stage.add_instance(stage.add_mesh(make_sphere(0.7f)), glass);
  for (const PointStyle style : {PointStyle::sprite, PointStyle::streak, PointStyle::sphere}) {
    const PointsHandle points = stage.add_points({.style = style});
    std::vector<Point> values;
    for (uint64_t i = 0; i < 60; ++i) {
      const auto t = static_cast<float>(i);
      values.push_back({.position = {1.5f * std::sin(t), 0.03f * t, std::cos(2 * t)},
                        .velocity = {0, -8, t * 0.1f},
                        .radius = 0.05f,
                        .color = {0.8f, 0.5f, 0.3f, 0.6f},
                        .id = i});
    }
    stage.set_points(points, values);
  }
  HdrImage sum;
  for (int i = 0; i < 2; ++i) stage.draw(sample_offsets(i, 2), sum);
  return pixel_hash(tone_map(sum, {.sample_weight = 0.5f}));
}

std::string hash_in_a_process_with(int raster_threads, std::string_view gl = "") {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string platform = gl.empty() ? "" : "OFFSTAGE_GL=" + std::string(gl) + " ";
  const std::string command = platform + kThreadsVariable + "=" + std::to_string(raster_threads) + " '" +
                              program + "' --gtest_filter=Context.DrawsTheSameSceneTwice";
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return "cannot run " + command;
  std::string hash;
  char line[256];
  while (std::fgets(line, sizeof line, pipe) != nullptr) {
    if (std::string(line).starts_with("hash ")) hash = line;
  }
  EXPECT_EQ(pclose(pipe), 0);
  return hash;
}

}  // namespace

Context& shared_context() {
  static Context context;
  return context;
}

namespace {

TEST(Context, IsLlvmpipeWithGl45) {
  const ContextInfo& info = shared_context().info();
  EXPECT_TRUE(info.renderer.starts_with("llvmpipe")) << info.renderer;
  EXPECT_NE(info.renderer.find("256 bits"), std::string::npos) << info.renderer;
  EXPECT_TRUE(info.version.starts_with("4.5 (Core Profile)")) << info.version;
  EXPECT_TRUE(info.glsl.starts_with("4.50")) << info.glsl;
}

TEST(Context, PinningRemovesVariablesThatWouldChangeThePicture) {
  setenv("MESA_GL_VERSION_OVERRIDE", "3.0", 1);
  setenv("GALLIUM_DRIVER", "softpipe", 1);
  pin_environment(1);
  EXPECT_EQ(std::getenv("MESA_GL_VERSION_OVERRIDE"), nullptr);
  EXPECT_STREQ(std::getenv("GALLIUM_DRIVER"), "llvmpipe");
  EXPECT_STREQ(std::getenv("LP_NUM_THREADS"), "1");
}

TEST(Context, CompiledShadersAreKeptOnlyInTheFolderThatIsNamed) {
  const char* inherited = std::getenv("OFFSTAGE_SHADER_CACHE");
  const std::string before = inherited == nullptr ? "" : inherited;
  setenv("MESA_SHADER_CACHE_DIR", "/elsewhere", 1);
  setenv("OFFSTAGE_SHADER_CACHE", "", 1);
  pin_environment(1);
  EXPECT_STREQ(std::getenv("MESA_SHADER_CACHE_DISABLE"), "true");
  EXPECT_EQ(std::getenv("MESA_SHADER_CACHE_DIR"), nullptr);
  setenv("OFFSTAGE_SHADER_CACHE", "/here", 1);
  pin_environment(1);
  EXPECT_STREQ(std::getenv("MESA_SHADER_CACHE_DISABLE"), "false");
  EXPECT_STREQ(std::getenv("MESA_SHADER_CACHE_DIR"), "/here");
  setenv("OFFSTAGE_SHADER_CACHE", before.c_str(), 1);
  pin_environment(1);
}

TEST(Context, TwoThreadsDrawTheSamePixelsAtTheSameTime) {
  std::string hashes[2];
  const auto draw = [&hashes](int k) {
    Context context;
    hashes[k] = hash_of_a_rich_scene(context);
  };
  std::thread one(draw, 0), other(draw, 1);
  one.join();
  other.join();
  EXPECT_EQ(hashes[0].size(), 32u);
  EXPECT_EQ(hashes[0], hashes[1]);
}

// Child processes of the next test also run this test and print the hash. It runs on a thread of its own,
// because the following tests draw with the context that is current on this thread.
TEST(Context, DrawsTheSameSceneTwice) {
  std::string first, second;
  std::thread([&] {
    Context context;
    first = hash_of_a_rich_scene(context);
    second = hash_of_a_rich_scene(context);
  }).join();
  EXPECT_EQ(first, second);
  std::printf("hash %s\n", first.c_str());
}

TEST(Context, TheNumberOfRasterThreadsDoesNotChangeThePixels) {
  const std::string none = hash_in_a_process_with(0), two = hash_in_a_process_with(2);
  EXPECT_EQ(none.size(), 38u) << none;  // "hash ", 32 digits, end of line
  EXPECT_EQ(none, two);
}

TEST(Context, OsmesaAndEglDrawTheSamePixels) {
  const std::string osmesa = hash_in_a_process_with(2, "osmesa"), egl = hash_in_a_process_with(2, "egl");
  EXPECT_EQ(osmesa.size(), 38u) << osmesa;
  EXPECT_EQ(osmesa, egl);
}

TEST(ContextPlatform, UnknownNamesAreRefusedWithTheList) {
  for (const char* name : {"auto", "osmesa", "egl", "egl:gpu"}) EXPECT_EQ(name_of(gl_platform(name)), name);
  try {
    gl_platform("glx");
    FAIL() << "taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "'glx' is not an OpenGL backend; the backends are auto, osmesa, egl, egl:gpu");
  }
}

TEST(ContextPlatform, AMissingLibraryIsNamedWithItsPackage) {
  try {
    SharedLibrary({"libNoSuchMesa.so.8", "libNoSuchMesa.so"}, "libnosuchmesa8");
    FAIL() << "loaded";
  } catch (const UnavailableError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("libNoSuchMesa.so.8"), std::string::npos) << message;
    EXPECT_TRUE(message.ends_with("apt-get install libnosuchmesa8")) << message;
  }
}

}  // namespace
}  // namespace offstage::render
