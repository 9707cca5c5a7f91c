#pragma once
/// Private: draws depth, normals, ids and motion (see channels.h) with one sample per pixel and no
/// sub-frames.

#include <span>

#include "render/channels.h"
#include "render/cloth_pass.h"
#include "render/mesh_pass.h"
#include "render/points_pass.h"

namespace offstage::render {

class ChannelsPass {
 public:
  ChannelsPass(int width_px, int height_px);
  void begin(const Matrix4f& clip_from_world, const Matrix4f& clip_before_from_world);
  void draw(const Instance& instance);
  void draw(const Cloth& cloth);
  /// Draws the balls of a set, after PointsPass has prepared it. Their previous positions follow from their
  /// velocity over `time` [s].
  void draw_balls(PointsPass& pass, const PointSet& set, float time);
  void end(Channels& result);

 private:
  void set_matrices(const Matrix4f& world_from_mesh, const Matrix4f& world_before_from_mesh, uint32_t id);

  int width_px_, height_px_;
  gl::Texture normal_id_, motion_depth_, depth_;
  gl::Framebuffer framebuffer_;
  Matrix4f clip_from_world_, clip_before_from_world_;
  gl::LazyProgram mesh_{{"channels.vert"}, {"channels.frag"}};
  gl::LazyProgram holes_{
      {"channels.vert"}, {"frame.glsl", "material.glsl", "channels.frag"}, {"TEXTURED 1", "DETAILED 1"}};
  gl::LazyProgram cloth_{{"channels.vert"}, {"channels.frag"}, {"CLOTH 1"}};
  gl::Texture white_;
  gl::VertexArray cloth_layout_;
  gl::StreamBuffer places_before_;
};

}  // namespace offstage::render
