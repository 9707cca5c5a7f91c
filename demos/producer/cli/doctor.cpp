// The command doctor: reports the capabilities of this machine.

#include <array>
#include <chrono>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <signal.h>
#include <sys/utsname.h>
#include <sys/wait.h>
#include <unistd.h>

#include "producer/base/version.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/run/fingerprint.h"
#include "render/context.h"
#include "render/error.h"
#include "render/image_io.h"
#include "render/mesh_io.h"
#include "render/primitives.h"
#include "render/sandbox.h"
#include "render/sink.h"
#include "render/stage.h"
#include "render/tone_map.h"

namespace offstage::producer {
namespace {

using Json = nlohmann::ordered_json;

/// Draws a small picture of a lit ball on a plane, and returns the hash of its pixels. This tests the whole
/// drawing.
std::string test_render_hash(render::Context& context) {
  render::Stage stage(context, {.width_px = 128, .height_px = 72});
  const auto material = stage.add_material({});
  stage.add_instance(stage.add_mesh(render::make_sphere(1)), material);
  const auto ground = stage.add_instance(stage.add_mesh(render::make_ground(100)), material, false);
  stage.set_transform(ground, Eigen::Affine3f(Eigen::Translation3f(0, -1, 0)));
  stage.set_camera({.eye = {0, 1.5f, 6}});
  render::HdrImage sum;
  stage.draw({}, sum);
  return render::pixel_hash(render::tone_map(sum, {}));
}

Json describe_platform(render::GlPlatform platform) {
  try {
    render::pin_environment(0, platform);
    render::Context context;
    return {{"renderer", context.info().renderer},
            {"version", context.info().version},
            {"glsl", context.info().glsl},
            {"test_render", test_render_hash(context)},
            {"fingerprint", fingerprint(context.info())}};
  } catch (const std::exception& error) {
    return {{"error", error.what()}};
  }
}

Json describe_egl_devices() {
  try {
    Json list = Json::array();
    for (const render::EglDevice& device : render::egl_devices()) {
      Json& item = list.emplace_back(Json{{"kind", device.software ? "software" : "gpu"}});
      if (!device.name.empty()) item["name"] = device.name;
      if (!device.file.empty()) item["file"] = device.file;
      item["extensions"] = device.extensions;
    }
    return list;
  } catch (const std::exception& error) {
    return {{"error", error.what()}};
  }
}

/// Runs `describe` in a separate process, for two reasons. Mesa reads its environment only once per process.
/// And a driver that crashes or hangs then gives only an "error" in the result.
Json in_child(const std::function<Json()>& describe) {
  constexpr std::chrono::seconds kLimit{60};
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("doctor: cannot create a pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("doctor: cannot start a process");
  if (child == 0) {
    close(ends[0]);
    const std::string text = describe().dump();
    const ssize_t written = write(ends[1], text.data(), text.size());
    _exit(written == static_cast<ssize_t>(text.size()) ? 0 : 1);
  }
  close(ends[1]);
  std::string text;
  const auto deadline = std::chrono::steady_clock::now() + kLimit;
  bool hangs = false;
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd waiting{.fd = ends[0], .events = POLLIN, .revents = 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(0, left.count())));
    if (ready < 0 && errno == EINTR) continue;
    hangs = ready <= 0;
    if (hangs) break;
    std::array<char, 4096> buffer{};
    const ssize_t count = read(ends[0], buffer.data(), buffer.size());
    if (count <= 0) break;
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  close(ends[0]);
  if (hangs) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (hangs) return {{"error", fmt::format("the driver did not respond within {} s", kLimit.count())}};
  Json result = Json::parse(text, nullptr, false);
  if (!result.is_discarded()) return result;
  return {{"error", WIFSIGNALED(status) ? fmt::format("the driver crashed with signal {}", WTERMSIG(status))
                                        : std::string("the driver ended the process")}};
}

/// Reports the GL of each platform, the EGL devices, the encoders, and the processor.
int doctor_command() {
  using render::GlPlatform;
  Json json = {{"offstage", version_text()}};
  Json gl;
  for (const GlPlatform platform : {GlPlatform::osmesa, GlPlatform::egl, GlPlatform::egl_gpu})
    gl[std::string(name_of(platform))] = in_child([&] { return describe_platform(platform); });
  int code = kUnavailable;
  std::string by_default = "none";
  for (const char* name : {"egl", "osmesa"}) {
    if (gl[name].contains("error")) continue;
    by_default = name;
    code = kOk;
  }
  json["gl_auto"] = by_default;
  json["gl"] = gl;
  json["egl_devices"] = in_child(describe_egl_devices);
  json["cpu"] = cpu_class();
  json["threads"] = available_processors();
  utsname system{};
  uname(&system);
  json["reader_of_models"] = "confined by " + render::sandbox_support();
  const std::vector<std::string> missing = render::missing_model_libraries();
  json["compressed_gltf"] = missing.empty() ? "Draco, meshoptimizer and WebP"
                                            : fmt::format("built without {}", fmt::join(missing, ", "));
  json["system"] = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  const std::vector<std::string> encoders = render::available_encoders();
  json["ffmpeg_encoders"] = encoders;
  if (encoders.empty()) {
    json["ffmpeg_error"] = "ffmpeg was not found or lacks the required encoders; install the package ffmpeg";
    code = kUnavailable;
  }
  print_readable(json);
  return code;
}

}  // namespace

Command add_doctor(CLI::App& app) {
  return {
      app.add_subcommand("doctor", "Report OpenGL backends, video encoders and processor of this machine"),
      doctor_command};
}

}  // namespace offstage::producer
