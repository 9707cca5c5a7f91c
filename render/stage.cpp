#include "render/stage.h"

#include <algorithm>

#include "render/sprite_pictures.h"
#include "render/stage_impl.h"

namespace offstage::render {

Stage::Stage(Context&, const StageDef& def) : impl_(std::make_unique<Impl>(def)) {}
Stage::~Stage() = default;
Stage::Stage(Stage&&) noexcept = default;

MeshHandle Stage::add_mesh(const Mesh& mesh) {
  const MeshHandle handle = impl_->meshes.add(std::make_unique<GpuMesh>(mesh));
  gl::check_error("uploading a mesh");
  return handle;
}

void Stage::set_mesh(MeshHandle handle, const Mesh& mesh) {
  GpuMesh& known = *impl_->meshes[handle];
  GpuMesh next(mesh);
  next.store_previous_vertices(known);
  known = std::move(next);
  gl::check_error("uploading a mesh");
}

MaterialHandle Stage::add_material(const Material& material, std::span<const Image> textures) {
  auto gpu = std::make_unique<GpuMaterial>(make_gpu_material(material, textures));
  gl::check_error("uploading a material");
  return impl_->materials.add(std::move(gpu));
}

InstanceHandle Stage::add_instance(MeshHandle mesh, MaterialHandle material, bool casts_shadow) {
  auto instance = std::make_unique<Instance>();
  instance->mesh = impl_->meshes[mesh].get();
  instance->material = impl_->materials[material].get();
  instance->batch_key = {material.index, mesh.index};
  instance->casts_shadow = casts_shadow;
  return impl_->instances.add(std::move(instance));
}

PointsHandle Stage::add_points(const PointsDef& def, const Image& picture) {
  auto set = std::make_unique<PointSet>();
  set->def = def;
  if (def.style == PointStyle::sphere)
    set->rays = std::make_unique<RayMaterial>(
        Material{
            .color = {1, 1, 1, 1}, .metallic = def.metallic, .roughness = def.roughness, .unlit = !def.lit},
        std::span<const Image>());
  if (def.style == PointStyle::sprite && picture.pixel_count() > 0) {
    set->pictures =
        impl_->points_pass.add_pictures(sprite_pictures(picture, def.sheet.columns, def.sheet.rows));
  }
  return impl_->point_sets.add(std::move(set));
}

LinesHandle Stage::add_lines(const LinesDef& def) {
  auto set = std::make_unique<LineSet>();
  set->def = def;
  return impl_->line_sets.add(std::move(set));
}

ClothHandle Stage::add_cloth(const ClothDef& def, MaterialHandle material) {
  auto cloth = std::make_unique<Cloth>();
  cloth->material = impl_->materials[material].get();
  cloth->thickness = def.thickness;
  cloth->texture_from_uv = def.texture_size.cwiseInverse();
  cloth->casts_shadow = def.casts_shadow;
  cloth->surface.set_mesh(def.triangles, def.uvs);
  return impl_->cloths.add(std::move(cloth));
}

void Stage::remove(InstanceHandle instance) {
  impl_->instances.remove(instance);
}
void Stage::remove(PointsHandle points) {
  impl_->point_sets.remove(points);
}
void Stage::remove(LinesHandle lines) {
  impl_->line_sets.remove(lines);
}
void Stage::remove(ClothHandle cloth) {
  impl_->cloths.remove(cloth);
}

void Stage::set_transform(InstanceHandle instance, const Eigen::Affine3f& world_from_mesh) {
  impl_->instances[instance]->world_from_mesh = world_from_mesh;
}
void Stage::set_visible(InstanceHandle instance, bool visible) {
  impl_->instances[instance]->visible = visible;
}
void Stage::set_points(PointsHandle points, std::span<const Point> values) {
  impl_->point_sets[points]->assign(values);
}
void Stage::set_lines(LinesHandle lines, std::span<const Line> values) {
  impl_->line_sets[lines]->assign(values);
}

void Stage::set_cloth(ClothHandle cloth, std::span<const Vector3f> positions) {
  Cloth& c = *impl_->cloths[cloth];
  c.surface.set_positions(positions, c.thickness);
}
void Stage::set_cloth_mesh(ClothHandle cloth, std::span<const uint32_t> triangles,
                           std::span<const Vector2f> uvs) {
  impl_->cloths[cloth]->surface.set_mesh(triangles, uvs);
}

void Stage::set_camera(const Camera& camera) {
  impl_->camera = camera;
}
void Stage::set_sun(const Sun& sun) {
  impl_->sun = sun;
}
void Stage::set_environment(const Environment& environment) {
  impl_->environment = environment;
}

void Stage::set_lamps(std::span<const Lamp> lamps) {
  impl_->lamps.assign(lamps.begin(), lamps.end());
}
void Stage::set_time(float time) {
  impl_->time = time;
}

void Stage::set_object(InstanceHandle instance, uint32_t id) {
  impl_->instances[instance]->object = id;
}
void Stage::set_object(ClothHandle cloth, uint32_t id) {
  impl_->cloths[cloth]->object = id;
}
void Stage::set_object(PointsHandle points, uint32_t id) {
  impl_->point_sets[points]->object = id;
}

void Stage::store_previous_transforms() {
  Impl& s = *impl_;
  s.camera_before = s.camera;
  s.meshes.for_each([](const std::unique_ptr<GpuMesh>& mesh) { mesh->store(); });
  s.instances.for_each([](const std::unique_ptr<Instance>& i) { i->before = i->world_from_mesh; });
  s.cloths.for_each([](const std::unique_ptr<Cloth>& cloth) {
    cloth->before.clear();
    for (const ClothVertex& v : cloth->surface.vertices()) cloth->before.push_back(v.position);
  });
}

LightSums Stage::light_sums() const {
  return impl_->light_pass.sums();
}

}  // namespace offstage::render
