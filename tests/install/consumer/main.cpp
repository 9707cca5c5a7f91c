// A program that uses the installed libraries: a ball falls freely for a second, and is drawn.

#include <cmath>
#include <cstdio>

#include "effects/blackbody.h"
#include "render/image_io.h"
#include "render/primitives.h"
#include "render/stage.h"
#include "render/tone_map.h"
#include "sim/world.h"

using namespace offstage;

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  sim::World world;
  const auto ball = world.add_body({.shape = sim::Sphere{0.5}, .pose = {.position = {0, 10, 0}}});
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  const double height = world.body(ball).pose.position.y(), expected = 10 - 9.81 / 2;

  render::pin_environment(1);
  render::Context context;
  render::Stage stage(context, {.width_px = 64, .height_px = 36});
  stage.add_instance(stage.add_mesh(render::make_box({1, 1, 1}, 0.1f)), stage.add_material({}));
  stage.set_camera({.eye = {0, 0, 5}, .target = {0, 0, 0}});
  render::HdrImage image;
  stage.draw(render::sample_offsets(0, 1), image);
  render::write_png(argv[1], render::tone_map(image, {}));

  std::printf("%.9f m, expected %.9f m\n", height, expected);
  return std::abs(height - expected) < 1e-9 ? 0 : 1;
}
