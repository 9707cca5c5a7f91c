// Simulates a box in free flight and a bouncing ball, and draws the last moment to a PNG file.
//
//   build/picture picture.png

#include <cstdio>
#include <exception>

#include "render/context.h"
#include "render/image_io.h"
#include "render/primitives.h"
#include "render/stage.h"
#include "render/tone_map.h"
#include "sim/world.h"

using namespace offstage;

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: picture FILE.png\n");
    return 2;
  }
  // The simulation: a spinning box in free flight over the ground, and one bouncing particle.
  sim::World world;
  const auto box = world.add_body({.name = "box",
                                   .shape = sim::Box{{0.6, 0.4, 0.2}},
                                   .pose = {.position = {-1.2, 1, 0}},
                                   .velocity = {0.8, 4.5, 0},
                                   .angular_velocity = {1, 3, 5}});
  world.add_body({.name = "ground", .shape = sim::Plane{}, .motion = sim::MotionType::static_body});
  const auto balls = world.add_particle_system({.name = "balls"});
  world.add_particle(balls, {.position = {1, 2, 0}, .mass = 0.5, .radius = 0.3, .restitution = 0.8});

  // The stage: each drawn object has a handle. Simulation and stage share nothing else.
  render::pin_environment(2);
  render::Context context;
  render::Stage stage(context, {.width_px = 960, .height_px = 540});
  const auto red = stage.add_material({.color = {0.7f, 0.1f, 0.05f, 1}, .roughness = 0.35f});
  const auto paving =
      stage.add_material({.color = {0.5f, 0.5f, 0.48f, 1}, .pattern = render::Pattern::paving});
  const auto drawn_box = stage.add_instance(stage.add_mesh(render::make_box({0.6f, 0.4f, 0.2f}, 0.02f)), red);
  stage.add_instance(stage.add_mesh(render::make_ground(500)), paving, false);
  const auto drawn_balls = stage.add_points({.style = render::PointStyle::sphere});
  stage.set_camera({.eye = {1.5f, 1.6f, 6}, .target = {0, 1, 0}});

  // The loop: one step per frame, then new transforms for the bodies that moved.
  for (int frame = 0; frame < 24; ++frame) {
    world.step(1.0 / 30);
    for (const sim::MovedBody& moved : world.moved())
      if (moved.body == box)
        stage.set_transform(drawn_box, Eigen::Translation3f(moved.pose.position.cast<float>()) *
                                           moved.pose.orientation.cast<float>());
  }
  const sim::ParticleArrays& ball = world.particles(balls);
  stage.set_points(drawn_balls, std::vector<render::Point>{{.position = ball.position[0].cast<float>(),
                                                            .velocity = ball.velocity[0].cast<float>(),
                                                            .radius = 0.3f,
                                                            .color = {0.9f, 0.6f, 0.1f, 1},
                                                            .id = 0}});

  // The picture: sixteen sub-frames, averaged and tone mapped.
  constexpr int kSubframes = 16;
  render::HdrImage sum;
  for (int i = 0; i < kSubframes; ++i) stage.draw(render::sample_offsets(i, kSubframes), sum);
  render::write_png(argv[1], render::tone_map(sum, {.sample_weight = 1.f / kSubframes}));
} catch (const std::exception& error) {
  std::fprintf(stderr, "picture: %s\n", error.what());
  return 1;
}
