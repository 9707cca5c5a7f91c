#pragma once
/// The contents of a stage, and the passes that draw it. Included by stage.cpp, which changes the contents,
/// and by stage_drawing.cpp, which draws them.

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "render/channels_pass.h"
#include "render/cloth_pass.h"
#include "render/frame.h"
#include "render/gl.h"
#include "render/lamps.h"
#include "render/light_pass.h"
#include "render/lines_pass.h"
#include "render/mesh_pass.h"
#include "render/paint_order.h"
#include "render/picture_copy.h"
#include "render/points_pass.h"
#include "render/puffs_pass.h"
#include "render/sky.h"
#include "render/slots.h"
#include "render/stage.h"
#include "render/streaks_pass.h"
#include "render/surface_probe.h"

namespace offstage::render {

struct ClothTag;
struct MeshTag;

struct Stage::Impl {
  static constexpr GLuint kFrameBlock = 0, kSceneDepthUnit = 4, kBehindUnit = 12, kBodiesUnit = 22;

  /// Colour and depth of the picture.
  struct Picture {
    gl::Texture color, depth;
    gl::Framebuffer framebuffer;
    PictureCopy depth_copy;  ///< depth of the picture, for particles
    PictureCopy behind;      ///< copy of the picture with the particles that are visible through glass
    gl::Texture bodies;      ///< the picture without particles; created when they may be behind glass
    gl::Framebuffer bodies_framebuffer;

    Picture(int width_px, int height_px)
        : color(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
          depth(gl::make_target(GL_DEPTH_COMPONENT32F, width_px, height_px, GL_NEAREST)),
          framebuffer(gl::make_framebuffer(color, depth)),
          depth_copy(GL_DEPTH_COMPONENT32F, GL_NEAREST, kSceneDepthUnit, width_px, height_px),
          behind(GL_RGBA32F, GL_LINEAR, kBehindUnit, width_px, height_px) {}

    /// Sets the depth buffer against which objects are tested.
    void test_against(GLuint other) const {
      for (const GLuint target : {GLuint(framebuffer), GLuint(bodies_framebuffer)})
        if (target != 0) glNamedFramebufferTexture(target, GL_DEPTH_ATTACHMENT, other, 0);
    }

    /// Begins the picture without particles: copies the opaque objects to it.
    void begin_bodies(int width_px, int height_px) {
      if (bodies == 0) {
        bodies = gl::make_target(GL_RGBA32F, width_px, height_px, GL_LINEAR);
        bodies_framebuffer = gl::make_framebuffer(bodies, depth);
      }
      glCopyImageSubData(color, GL_TEXTURE_2D, 0, 0, 0, 0, bodies, GL_TEXTURE_2D, 0, 0, 0, 0, width_px,
                         height_px, 1);
      glBindTextureUnit(kBodiesUnit, bodies);
    }
  };
  /// A body through which other objects are visible.
  struct TranslucentBody {
    const Cloth* cloth = nullptr;  ///< the cloth; null: the body is an instance of a mesh
    std::size_t instance = 0;      ///< index in MeshPass::translucent
    bool glass = false;
    bool fills_region = false;
    Eigen::AlignedBox2i area_px;    ///< area of the picture that the body covers
    Eigen::AlignedBox2i looked_px;  ///< area of the picture that is visible through it by refraction
  };

  StageDef def;
  Camera camera;
  std::optional<Camera> camera_before;
  Sun sun;
  Environment environment;
  SkyModel sky;                                    ///< sky in this sub-frame
  std::shared_ptr<const SkyPicture> uploaded_sky;  ///< sky picture that the textures contain
  gl::Texture sky_levels, sky_background;
  std::vector<Lamp> lamps;
  std::vector<Lamp> shining;  ///< lamps and fires of this sub-frame
  float time = 0;
  Features features;                    ///< light-dependent definitions for the shaders in this sub-frame
  bool sun_is_tinted = false;           ///< see LightSources, in this sub-frame
  bool particles_behind_glass = false;  ///< whether this sub-frame may show particles through glass
  LightSources light_sources;           ///< sources of light in this sub-frame
  RayParticles ray_particles;           ///< the particles in mirror images of this sub-frame

  Slots<std::unique_ptr<GpuMesh>, MeshTag> meshes{"mesh"};
  Slots<std::unique_ptr<GpuMaterial>, MaterialTag> materials{"material"};
  Slots<std::unique_ptr<Instance>, InstanceTag> instances{"instance"};
  Slots<std::unique_ptr<PointSet>, PointsTag> point_sets{"point set"};
  Slots<std::unique_ptr<LineSet>, LinesTag> line_sets{"line set"};
  Slots<std::unique_ptr<Cloth>, ClothTag> cloths{"cloth"};

  Picture picture;
  LightPass light_pass;
  MeshPass mesh_pass;
  ClothPass cloth_pass;
  PointsPass points_pass;
  PaintOrder paint_order;
  PuffsPass puffs_pass;
  StreaksPass streaks_pass;
  SurfaceProbe surface_probe;
  LinesPass lines_pass;
  std::optional<ChannelsPass> channels_pass;  ///< created on first use
  std::map<Features, gl::LazyProgram> sky_programs, plain_programs;
  gl::VertexArray no_attributes = gl::make_vertex_array();
  gl::StreamBuffer frame_buffer;
  std::vector<float> strip;

  explicit Impl(const StageDef& stage_def)
      : def(stage_def),
        picture(def.width_px, def.height_px),
        light_pass(def.width_px, def.height_px, picture.depth, def.quick),
        mesh_pass(def.quick),
        puffs_pass(def.width_px, def.height_px),
        streaks_pass(def.width_px, def.height_px),
        surface_probe(def.width_px, def.height_px),
        strip(static_cast<std::size_t>(def.width_px) * StreakBands::kRows * 4) {
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl::check_error("creating the stage");
  }

  void upload(const FrameUniforms& frame) {
    frame_buffer.write(std::span<const FrameUniforms>(&frame, 1));
    glBindBufferBase(GL_UNIFORM_BUFFER, kFrameBlock, frame_buffer);
  }
  void prepare_sky();
  void draw_sky();
  void draw_plain();
  std::vector<PointSet*> prepare_points(const View& view);
  std::vector<const Cloth*> prepare_cloths();
  void prepare_lamps(std::span<const Instance* const> shown, std::span<PointSet* const> sets);
  void trace_light(std::span<const Instance* const> shown, std::span<const Cloth* const> sheets,
                   std::span<PointSet* const> sets, const View& view, const FrameUniforms& frame,
                   const SampleOffsets& offsets, const StopTest& stop);
  void trace_glass(const View& view, const SampleOffsets& offsets);
  void draw_surfaces(std::span<const Cloth* const> sheets, std::span<PointSet* const> sets);
  void draw_opaque(std::span<const Cloth* const> sheets, std::span<PointSet* const> sets);
  std::vector<TranslucentBody> find_bodies(std::span<const Cloth* const> sheets, const View& view,
                                           std::vector<Region>& regions);
  void draw_translucent(std::span<const Cloth* const> sheets, std::span<PointSet* const> sets,
                        const View& view, const FrameUniforms& frame, const SampleOffsets& offsets);
  void probe_surfaces(std::span<const TranslucentBody> bodies, std::span<PointSet* const> sets,
                      const FrameUniforms& frame, std::vector<Region>& regions);
  void draw_run(const PaintOrder::Run& run, const View& view, const FrameUniforms& frame);
  void draw_body(const TranslucentBody& body, const View& view, const FrameUniforms& frame,
                 const SampleOffsets& offsets);
  void draw_in_light(const TranslucentBody& body);
  void draw_layers(const TranslucentBody& body, const View& view, const SampleOffsets& offsets);
  void lay_streaks_behind(const Eigen::AlignedBox2i& area_px, const FrameUniforms& frame);
  void draw_lines(const View& view);
  void add_picture(const FrameUniforms& frame, HdrImage& sum);
};

}  // namespace offstage::render
