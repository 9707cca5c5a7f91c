/// Draws a sub-frame of a stage: the surfaces, their light, and the objects that are visible through others.

#include <algorithm>

#include "render/particle_rays.h"
#include "render/stage_impl.h"
#include "render/texture.h"
#include "render/trace/light_path.h"

namespace offstage::render {
namespace {

// Texture units of shaders/sky.glsl and sky.frag.
constexpr GLuint kSkyLevelsUnit = 23, kSkyBackgroundUnit = 24;

/// Returns the particles whose look depends on the light around them.
std::vector<AirField::Ball> lit_particles(const PaintOrder& order) {
  std::vector<AirField::Ball> result;
  using enum PaintOrder::Kind;
  for (const PaintOrder::Kind kind : {puffs, sprites, flakes, streaks}) {
    for (const uint64_t key : order.keys(kind)) {
      const PaintOrder::Place at = order.place(kind, key);
      const GpuPoint& point = at.set->points[at.index];
      if (at.set->def.lit && at.set->def.style != PointStyle::fire)
        result.push_back({point.position.head<3>(), point.velocity.w()});
    }
  }
  return result;
}

/// Returns whether the light that passes a mesh is traced by photons: it is solid glass that turns light.
/// Light passes smooth panes in a straight line.
bool needs_photons(const RayMaterial& material, const RayMesh& mesh) {
  return material.transmission > 0 && !material.thin &&
         (is_rough_glass(material.roughness) || !mesh.is_plate());
}

/// Returns whether light passes an object in a straight line and gets another colour.
bool tints(const Instance& instance) {
  const RayMaterial& material = *instance.material->rays;
  return instance.visible && instance.casts_shadow && material.transmission > 0 && material.is_tinted() &&
         !needs_photons(material, *instance.mesh->rays);
}

}  // namespace

// Uploads the sky and its picture as textures.
void Stage::Impl::prepare_sky() {
  sky = make_sky(sun, environment);
  const std::shared_ptr<const SkyPicture>& picture_of_sky = environment.picture;
  if (!picture_of_sky) return;
  if (uploaded_sky != picture_of_sky) {
    sky_levels = make_texture(picture_of_sky->levels());
    sky_background = make_texture(picture_of_sky->background());
    uploaded_sky = picture_of_sky;
  }
  glBindTextureUnit(kSkyLevelsUnit, sky_levels);
  glBindTextureUnit(kSkyBackgroundUnit, sky_background);
}

// Draws the sky at the far plane. The depth test limits it to pixels without a surface, which have this
// depth.
void Stage::Impl::draw_sky() {
  Features defines = {"FLAT 1"};
  for (const std::string& feature : features)
    if (feature.starts_with("SKY_")) defines.push_back(feature);
  const std::vector<std::string_view> vertex = {"frame.glsl", "sky.vert"};
  const std::vector<std::string_view> fragment = {"frame.glsl", "sky.glsl", "noise.glsl", "sky.frag"};
  sky_programs.try_emplace(defines, vertex, fragment, defines).first->second.use();
  glDepthFunc(GL_EQUAL);
  glBindVertexArray(no_attributes);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

// Draws the plain surfaces of a quick picture.
void Stage::Impl::draw_plain() {
  Features defines = features;
  defines.push_back("FLAT 1");
  const std::vector<std::string_view> vertex = {"frame.glsl", "sky.vert"};
  const std::vector<std::string_view> fragment = {"frame.glsl", "sky.glsl", "light.glsl", "traced.glsl",
                                                  "plain.frag"};
  plain_programs.try_emplace(defines, vertex, fragment, defines).first->second.use();
  light_pass.bind_surfaces();
  glDisable(GL_CULL_FACE);
  glDepthFunc(GL_ALWAYS);
  glBindVertexArray(no_attributes);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

std::vector<PointSet*> Stage::Impl::prepare_points(const View& view) {
  std::vector<PointSet*> result;
  point_sets.for_each([&](const std::unique_ptr<PointSet>& set) {
    if (set->points.empty()) return;
    if (!set->is_splatted()) points_pass.prepare(*set, view);
    result.push_back(set.get());
  });
  return result;
}

std::vector<const Cloth*> Stage::Impl::prepare_cloths() {
  std::vector<const Cloth*> result;
  cloths.for_each([&](const std::unique_ptr<Cloth>& cloth) {
    if (!cloth->is_seen()) return;
    cloth_pass.prepare(*cloth);
    result.push_back(cloth.get());
  });
  return result;
}

void Stage::Impl::prepare_lamps(std::span<const Instance* const> shown, std::span<PointSet* const> sets) {
  shining.clear();
  for (const Lamp& lamp : lamps)
    if (lamp.intensity.sum() > 0) shining.push_back(lamp);
  for (const PointSet* set : sets)
    if (set->def.style == PointStyle::fire) shining.push_back(lamp_of_fire(*set));
  features.clear();
  if (!shining.empty() || sky.has_bright_part()) features.push_back("LAMPS 1");
  sun_is_tinted = sun.intensity > 0 && sun.shadows &&
                  std::ranges::any_of(shown, [](const Instance* instance) { return tints(*instance); });
  if (sun_is_tinted) features.push_back("TINTED_SUN 1");
  if (sky.turned.picture) features.push_back("SKY_PICTURE 1");
  if (sky.turned.picture && !sky.seen_as_colors) features.push_back("SKY_SEEN 1");
}

// Draws the depth and the surfaces of all opaque objects. The depth also limits later shading to visible
// points.
void Stage::Impl::draw_surfaces(std::span<const Cloth* const> sheets, std::span<PointSet* const> sets) {
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer);
  const float nothing[4] = {0, 0, 0, 0};
  glDepthMask(GL_TRUE);
  glClearNamedFramebufferfv(picture.framebuffer, GL_COLOR, 0, nothing);
  glClearNamedFramebufferfv(picture.framebuffer, GL_DEPTH, 0, nothing);
  light_pass.begin();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glDisable(GL_BLEND);
  for (const Cloth* cloth : sheets)
    if (!cloth->is_translucent()) cloth_pass.draw_surface(*cloth);
  mesh_pass.draw_opaque(MeshPass::Shading::surface);
  glDisable(GL_CULL_FACE);
  for (const PointSet* set : sets)
    if (set->def.style == PointStyle::sphere) points_pass.draw_surfaces(*set);
}

void Stage::Impl::trace_light(std::span<const Instance* const> shown, std::span<const Cloth* const> sheets,
                              std::span<PointSet* const> sets, const View& view, const FrameUniforms& frame,
                              const SampleOffsets& offsets, const StopTest& stop) {
  RayScene& scene = light_pass.scene();
  scene.clear(time);
  light_sources = {.sun = sun, .sky = sky, .sky_is_visible = environment.visible, .fog = environment.fog};
  light_sources.sun_is_tinted = sun_is_tinted;
  light_sources.open_air.constant = frame.irradiance_at(0);
  light_sources.open_air.slope << frame.irradiance_at(3), frame.irradiance_at(1), frame.irradiance_at(2);
  for (const Instance* instance : shown) {
    if (!instance->visible) continue;
    const RayMaterial& material = *instance->material->rays;
    const RayMesh& mesh = *instance->mesh->rays;
    const bool focuses = instance->casts_shadow && !instance->mesh->endless && needs_photons(material, mesh);
    const unsigned object =
        scene.add(mesh, material, instance->world_from_mesh, instance->casts_shadow, focuses);
    if (object != RayScene::kNone && focuses)
      light_sources.glass.push_back(
          {object, instance->world_from_mesh * instance->mesh->box.min(),
           instance->world_from_mesh.linear() * instance->mesh->box.sizes().asDiagonal()});
    if (object != RayScene::kNone && !material.mean_emission().isZero())
      light_sources.glow.add(object, mesh, material, instance->world_from_mesh, instance->center(),
                             instance->radius(), instance->is_ball());
  }
  light_sources.glow.limit();
  for (const Cloth* cloth : sheets)
    scene.add_cloth(cloth->surface.vertices(), cloth->surface.indices(), *cloth->material->rays,
                    cloth->texture_from_uv, cloth->casts_shadow);
  for (const PointSet* set : sets) {
    const GpuPoint& first = set->points.front();
    if (set->def.style == PointStyle::sphere)
      scene.add_balls(&first.position, &first.color, sizeof(GpuPoint), set->points.size(), *set->rays,
                      set->def.casts_shadow);
    else if (set->def.casts_shadow && !set->is_splatted())
      scene.add_sprites(&first.position, &first.color, sizeof(GpuPoint), set->points.size(),
                        set->def.softness);
  }
  scene.build();
  for (const Lamp& lamp : shining) {
    const bool within_glass = std::ranges::any_of(light_sources.glass, [&](const GlassPiece& piece) {
      return piece.contains(lamp.position, lamp.radius);
    });
    light_sources.lamps.emplace_back(lamp, within_glass);
  }
  if (sky.has_bright_part()) light_sources.lamps.emplace_back(sky.turned);
  if (!puffs_pass.grid().empty()) light_sources.smoke = &puffs_pass.grid();
  if (std::ranges::any_of(sets, [](const PointSet* set) { return set->def.style != PointStyle::sphere; })) {
    ray_particles.reset([this, sets, &view, pixel_m = frame.eye.w()] {
      return particles_for_rays(sets, puffs_pass, view, pixel_m);
    });
    light_sources.particles = &ray_particles;
  }
  light_pass.trace(light_sources, view, offsets, stop);
}

// Traces the light of the nearest surfaces of glass. Rays find the surfaces behind them.
void Stage::Impl::trace_glass(const View& view, const SampleOffsets& offsets) {
  ScreenArea area(view, 0);
  for (const Instance* instance : mesh_pass.translucent()) {
    if (!instance->material->glass) continue;
    const Region region{instance->mesh->box, instance->world_from_mesh, instance->mesh->round, view};
    for (const Vector3f& corner : region.corners()) area.add(corner);
  }
  if (area.empty()) return;
  Eigen::AlignedBox2i area_px = area.pixels(def.width_px, def.height_px);
  area_px = Eigen::AlignedBox2i(area_px.min().array() - 1, area_px.max().array() + 1);
  if (!light_pass.begin_part(picture.depth, area_px)) return;
  for (std::size_t k = 0; k < mesh_pass.translucent().size(); ++k)
    if (mesh_pass.translucent()[k]->material->glass)
      mesh_pass.draw_translucent(k, MeshPass::Shading::surface);
  light_pass.trace_glass(light_sources, view, offsets, picture.framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer);
}

void Stage::Impl::draw_opaque(std::span<const Cloth* const> sheets, std::span<PointSet* const> sets) {
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer);
  glViewport(0, 0, def.width_px, def.height_px);
  glDepthMask(GL_FALSE);
  if (def.quick) draw_plain();
  glDepthFunc(GL_GEQUAL);  // a surface passes the test against its own depth, which was drawn before
  for (const Cloth* cloth : sheets)
    if (!cloth->is_translucent()) cloth_pass.draw(*cloth, features);
  mesh_pass.draw_opaque(MeshPass::Shading::traced);
  glDisable(GL_CULL_FACE);
  for (const PointSet* set : sets) {
    if (set->def.style == PointStyle::sphere) points_pass.draw_spheres(*set, features);
  }
  if (environment.visible) draw_sky();
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_GREATER);
  picture.depth_copy.change_all();
  picture.behind.change_all();
}

auto Stage::Impl::find_bodies(std::span<const Cloth* const> sheets, const View& view,
                              std::vector<Region>& regions) -> std::vector<TranslucentBody> {
  std::vector<TranslucentBody> found;
  std::vector<Region> places;
  std::vector<Eigen::AlignedBox2i> areas;
  const auto add = [&](TranslucentBody body, const Region& region, float refraction_m) {
    const auto area_within = [&](float margin) {
      ScreenArea area(view, margin);
      for (const Vector3f& corner : region.corners()) area.add(corner);
      if (area.empty()) return Eigen::AlignedBox2i();
      const Eigen::AlignedBox2i pixels = area.pixels(def.width_px, def.height_px);
      return Eigen::AlignedBox2i(pixels.min().array() - 1, pixels.max().array() + 1);
    };
    body.area_px = area_within(0);
    if (body.area_px.isEmpty()) return;
    body.looked_px = area_within(refraction_m);
    areas.push_back(body.area_px);
    places.push_back(region);
    found.push_back(body);
  };
  const std::span<const Instance* const> see_through = mesh_pass.translucent();
  for (std::size_t k = 0; k < see_through.size(); ++k) {
    const Instance& instance = *see_through[k];
    // Glass reads the background from up to twice its thickness away.
    const bool fills = instance.mesh->round || instance.mesh->boxy || instance.mesh->flat;
    add({.instance = k, .glass = instance.material->glass, .fills_region = fills},
        {instance.mesh->box, instance.world_from_mesh, instance.mesh->round, view},
        2.5f * instance.mesh->thickness * instance.scale());
  }
  for (const Cloth* cloth : sheets) {
    if (!cloth->is_translucent()) continue;
    const Vector3f half = Vector3f::Constant(0.5f * cloth->thickness);
    Eigen::AlignedBox3f box = cloth->surface.box();
    add({.cloth = cloth}, {{box.min() - half, box.max() + half}, Eigen::Affine3f::Identity(), false, view},
        0);
  }
  std::vector<TranslucentBody> ordered;
  for (const uint32_t k : back_to_front(places, areas)) {
    ordered.push_back(found[k]);
    regions.push_back(places[k]);
  }
  return ordered;
}

// Sets the visible surfaces of the bodies that have particles in their boxes; see Region::set_surface().
void Stage::Impl::probe_surfaces(std::span<const TranslucentBody> bodies, std::span<PointSet* const> sets,
                                 const FrameUniforms& frame, std::vector<Region>& regions) {
  const Eigen::AlignedBox2i all(Eigen::Vector2i(0, 0), Eigen::Vector2i(def.width_px, def.height_px));
  const Vector2f size_px = all.sizes().cast<float>();
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const TranslucentBody& body = bodies[k];
    const Eigen::AlignedBox2i area = body.area_px.intersection(all);
    const bool apart = std::ranges::none_of(sets, [&](const PointSet* set) {
      return set->def.style != PointStyle::sphere && set->box.intersects(regions[k].world_box());
    });
    if (body.fills_region || apart || area.isEmpty() || area.volume() == 0) continue;
    regions[k].set_surface(area,
                           surface_probe.distances(area, frame,
                                                   [&] {
                                                     glDisable(GL_CULL_FACE);
                                                     if (body.cloth)
                                                       cloth_pass.draw_depth(*body.cloth);
                                                     else
                                                       mesh_pass.draw_translucent_depth(body.instance);
                                                   }),
                           size_px);
  }
}

void Stage::Impl::lay_streaks_behind(const Eigen::AlignedBox2i& area_px, const FrameUniforms& frame) {
  picture.behind.change(streaks_pass.draw_behind(area_px, frame, picture.color));
}

void Stage::Impl::draw_run(const PaintOrder::Run& run, const View& view, const FrameUniforms& frame) {
  if (run.kind == PaintOrder::Kind::streaks) return streaks_pass.pass(run.first);
  const bool puffs = run.kind == PaintOrder::Kind::puffs;
  Eigen::AlignedBox2i area(Eigen::Vector2i(0, 0), Eigen::Vector2i(def.width_px, def.height_px));
  if (paint_order.run_count() > 1)
    area = puffs ? puffs_pass.area_px(run.first, run.last)
                 : paint_order.area_px(run, view, def.width_px, def.height_px);
  if (area.isEmpty()) return;
  lay_streaks_behind(area, frame);
  picture.depth_copy.update(picture.depth, area);
  if (puffs)
    puffs_pass.draw(run.first, run.last, frame, picture.framebuffer);
  else
    points_pass.draw_blended(run.kind == PaintOrder::Kind::sprites ? PointStyle::sprite : PointStyle::flake,
                             run.first, run.last);
  picture.behind.change(area);
}

// Draws a translucent body in its traced light, and also into the picture without particles.
void Stage::Impl::draw_in_light(const TranslucentBody& body) {
  const auto draw = [&](bool particles) {
    using enum MeshPass::Shading;
    if (body.cloth)
      cloth_pass.draw(*body.cloth, features);
    else
      mesh_pass.draw_translucent(body.instance, particles ? traced_with_particles : traced);
  };
  if (particles_behind_glass) {
    glBindFramebuffer(GL_FRAMEBUFFER, picture.bodies_framebuffer);
    draw(false);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer);
  if (body.glass) glDepthMask(GL_TRUE);
  draw(body.glass && particles_behind_glass);
}

// Draws a translucent body that is not glass from back to front in layers: the parts of its surface that are
// first, second ... on the lines of sight, counted from the back. Each layer is drawn in its own light. What
// remains in front of the last layer is drawn at once in the light of its nearest surface.
void Stage::Impl::draw_layers(const TranslucentBody& body, const View& view, const SampleOffsets& offsets) {
  // More layers cost more than a tenth of a frame, and are rare except in crumpled cloth.
  constexpr int kMostLayers = 2;
  GLuint behind = picture.depth;
  for (int k = 0; k <= kMostLayers; ++k) {
    const bool rest = k == kMostLayers;
    if (!(rest ? light_pass.begin_part(behind, body.area_px) : light_pass.begin_layer(behind, body.area_px)))
      break;
    if (body.cloth)
      cloth_pass.draw_surface(*body.cloth);
    else
      mesh_pass.draw_translucent(body.instance, MeshPass::Shading::layer);
    const GLuint layer = light_pass.trace_body(light_sources, view, offsets);
    if (layer == 0) break;
    picture.test_against(rest ? behind : layer);
    glDepthFunc(rest ? GL_GREATER : GL_EQUAL);
    glDepthMask(GL_FALSE);
    glEnable(GL_BLEND);
    draw_in_light(body);
    behind = layer;
  }
  picture.test_against(picture.depth);
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer);
  glDepthFunc(GL_GREATER);
  if (!body.cloth) return;
  glDepthMask(GL_TRUE);
  cloth_pass.draw_depth(*body.cloth);
}

void Stage::Impl::draw_body(const TranslucentBody& body, const View& view, const FrameUniforms& frame,
                            const SampleOffsets& offsets) {
  lay_streaks_behind(body.looked_px, frame);
  if (body.glass) {
    if (particles_behind_glass) picture.behind.update(picture.color, body.looked_px);
    glDisable(GL_BLEND);
    draw_in_light(body);
  } else {
    draw_layers(body, view, offsets);
  }
  if (body.glass || body.cloth) picture.depth_copy.change(body.area_px);
  picture.behind.change(body.area_px);
  glEnable(GL_BLEND);
  glDepthMask(GL_FALSE);
  glDisable(GL_CULL_FACE);
}

void Stage::Impl::draw_translucent(std::span<const Cloth* const> sheets, std::span<PointSet* const> sets,
                                   const View& view, const FrameUniforms& frame,
                                   const SampleOffsets& offsets) {
  std::vector<Region> regions;
  const std::vector<TranslucentBody> bodies = find_bodies(sheets, view, regions);
  probe_surfaces(bodies, sets, frame, regions);
  paint_order.build(sets, regions, view);
  const AirLight air(light_pass.scene(), light_sources, offsets);
  const AirField around(LightTracer(light_pass.scene(), light_sources), offsets, lit_particles(paint_order),
                        light_sources.open_air);
  SkyModel sky_of_frame = sky;
  sky_of_frame.sun_direction = frame.sun_direction.head<3>();
  const PuffLight light{
      {puffs_pass.grid(), air, around, sun.direction.normalized(), frame.sun_radiance.head<3>()},
      frame,
      sky_of_frame};
  points_pass.prepare_blended(paint_order, light);
  puffs_pass.prepare_splats(paint_order, view, light);
  streaks_pass.prepare(paint_order, view, light, offsets.index == 0);

  // Colours are premultiplied. Additive light then has the alpha 0, so one blend function draws both kinds of
  // particles.
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);
  glDisable(GL_CULL_FACE);
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer);
  if (particles_behind_glass) picture.begin_bodies(def.width_px, def.height_px);
  for (std::size_t k = 0; k <= bodies.size(); ++k) {
    for (const PaintOrder::Run& run : paint_order.runs_before(k)) draw_run(run, view, frame);
    if (k < bodies.size()) draw_body(bodies[k], view, frame, offsets);
  }
}

void Stage::Impl::draw_lines(const View& view) {
  line_sets.for_each([&](const std::unique_ptr<LineSet>& set) {
    lines_pass.prepare(*set, view);
    lines_pass.draw(*set, def.width_px, def.height_px);
  });
}

// Adds the picture to the sum in bands of rows that fit into the processor's cache. OpenGL's rows are from
// the bottom up.
void Stage::Impl::add_picture(const FrameUniforms& frame, HdrImage& sum) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, picture.framebuffer);
  const std::size_t row = static_cast<std::size_t>(sum.width_px) * 4;
  for (int bottom = 0; bottom < sum.height_px; bottom += StreakBands::kRows) {
    const int rows = std::min(StreakBands::kRows, sum.height_px - bottom);
    glReadPixels(0, bottom, sum.width_px, rows, GL_RGBA, GL_FLOAT, strip.data());
    streaks_pass.blend_over(bottom, rows, frame, strip);
    for (int y = 0; y < rows; ++y) {
      const float* in = strip.data() + static_cast<std::size_t>(y) * row;
      float* out = sum.rgba.data() + static_cast<std::size_t>(sum.height_px - 1 - bottom - y) * row;
      for (std::size_t i = 0; i < row; ++i) out[i] += in[i];
    }
  }
}

void Stage::draw(const SampleOffsets& offsets, HdrImage& sum, const StopTest& stop) {
  Impl& s = *impl_;
  if (sum.width_px != s.def.width_px || sum.height_px != s.def.height_px ||
      sum.rgba.size() != sum.pixel_count() * 4) {
    sum = {s.def.width_px, s.def.height_px, {}};
    sum.rgba.assign(sum.pixel_count() * 4, 0.0f);
  }
  sum.transparent = !s.environment.visible;
  const View view = make_view(s.camera, offsets, s.def.width_px, s.def.height_px);
  s.prepare_sky();
  const FrameUniforms frame = make_frame(view, s.sun, s.environment, offsets, s.time, s.def.height_px);

  std::vector<const Instance*> shown;
  s.instances.for_each([&](const std::unique_ptr<Instance>& instance) { shown.push_back(instance.get()); });
  const std::vector<PointSet*> sets = s.prepare_points(view);
  s.upload(frame);
  s.puffs_pass.prepare(sets, s.sun);
  s.particles_behind_glass =
      std::ranges::any_of(shown, [](const Instance* i) { return i->visible && i->material->glass; }) &&
      std::ranges::any_of(sets, [](const PointSet* set) { return set->def.style != PointStyle::sphere; });
  s.prepare_lamps(shown, sets);
  s.mesh_pass.prepare(shown, view, s.features);
  const std::vector<const Cloth*> sheets = s.prepare_cloths();
  s.draw_surfaces(sheets, sets);
  s.trace_light(shown, sheets, sets, view, frame, offsets, stop);
  s.draw_opaque(sheets, sets);
  s.trace_glass(view, offsets);
  s.draw_translucent(sheets, sets, view, frame, offsets);
  s.draw_lines(view);

  s.add_picture(frame, sum);
  gl::check_error("drawing a frame");
}

Channels Stage::channels(float time) {
  Impl& s = *impl_;
  if (!s.channels_pass) s.channels_pass.emplace(s.def.width_px, s.def.height_px);
  ChannelsPass& pass = *s.channels_pass;
  const auto view_of = [&](const Camera& camera) {
    return make_view(camera, {}, s.def.width_px, s.def.height_px);
  };
  const View view = view_of(s.camera);
  s.upload(make_frame(view, s.sun, s.environment, {}, s.time, s.def.height_px));
  const std::vector<PointSet*> sets = s.prepare_points(view);
  const std::vector<const Cloth*> sheets = s.prepare_cloths();
  pass.begin(view.clip_from_world, view_of(s.camera_before.value_or(s.camera)).clip_from_world);
  s.instances.for_each([&](const std::unique_ptr<Instance>& instance) {
    if (instance->visible && instance->mesh->index_count > 0 && !instance->material->blended &&
        view.sees(instance->center(), instance->radius()))
      pass.draw(*instance);
  });
  for (const Cloth* cloth : sheets) pass.draw(*cloth);
  for (const PointSet* set : sets)
    if (set->def.style == PointStyle::sphere) pass.draw_balls(s.points_pass, *set, time);
  Channels result;
  pass.end(result);
  return result;
}

}  // namespace offstage::render
