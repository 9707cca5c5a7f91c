#include "producer/export/usd_looks.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "producer/export/usd_text.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

using Eigen::Vector3f;
using Eigen::Vector4f;

const char* wrap_name(render::Wrap wrap) {
  return wrap == render::Wrap::clamp ? "clamp" : wrap == render::Wrap::mirror ? "mirror" : "repeat";
}

std::string four(const Vector4f& v) {
  return fmt::format("({}, {}, {}, {})", usd::text(v.x()), usd::text(v.y()), usd::text(v.z()),
                     usd::text(v.w()));
}

/// Returns a node that transforms texture coordinates. The coordinates of USD point upwards, those of the map
/// downwards, so the transform of v is that of 1 - v.
std::string transform_node(const UvTransform& transform, const std::string& path, const std::string& name) {
  const float s = std::sin(transform.angle), c = std::cos(transform.angle);
  const Eigen::Vector2f translation(s * transform.scale.y() + transform.offset.x(),
                                    1 - c * transform.scale.y() - transform.offset.y());
  return fmt::format(
      "def Shader \"{0}Transform\"\n{{\nuniform token info:id = \"UsdTransform2d\"\n"
      "float2 inputs:in.connect = <{1}/{0}Coordinates.outputs:result>\nfloat inputs:rotation = {2}\n"
      "float2 inputs:scale = {3}\nfloat2 inputs:translation = {4}\nfloat2 outputs:result\n}}\n",
      name, path, usd::text(transform.angle * 180 / std::numbers::pi_v<float>), usd::text(transform.scale),
      usd::text(translation));
}

}  // namespace

std::string UsdLooks::write() {
  std::string out = "def Scope \"Materials\"\n{\n";
  usd::PrimNames names;
  for (const FilmMaterial& m : parts_.materials) {
    const std::string name = names(m.name);
    paths_.push_back("/World/Materials/" + name);
    out += material(m, name);
  }
  return out + "}\n";
}

std::string UsdLooks::material(const FilmMaterial& source, const std::string& name) const {
  const std::string path = "/World/Materials/" + name;
  std::string out = fmt::format(
      "def Material \"{}\"\n{{\ntoken outputs:surface.connect = <{}/Surface.outputs:surface>\n"
      "def Shader \"Surface\"\n{{\nuniform token info:id = \"UsdPreviewSurface\"\n{}token outputs:surface\n"
      "}}\n",
      name, path, inputs(source.look, path));
  for (const Node& node : nodes(source.look)) out += texture(source.look, name, node);
  return out + "}\n";
}

/// Returns the inputs of the surface shader: constants, or connections to the textures of nodes().
std::string UsdLooks::inputs(const render::Material& look, const std::string& path) const {
  const auto input = [&](const char* type, const char* key, const std::string& value, bool has_texture,
                         const char* node, const char* channel) {
    return has_texture
               ? fmt::format("{} inputs:{}.connect = <{}/{}.outputs:{}>\n", type, key, path, node, channel)
               : fmt::format("{} inputs:{} = {}\n", type, key, value);
  };
  const bool surface_map = look.metallic_roughness_texture.image >= 0;
  std::string out =
      input("color3f", "diffuseColor", usd::text(Vector3f(look.color.head<3>())),
            look.base_color_texture.image >= 0, "Texture", "rgb") +
      input("color3f", "emissiveColor", usd::text(look.emission), look.emission_texture.image >= 0,
            "EmissionTexture", "rgb") +
      input("float", "metallic", usd::text(look.metallic), surface_map, "SurfaceTexture", "b") +
      input("float", "roughness", usd::text(look.roughness), surface_map, "SurfaceTexture", "g") +
      input("float", "opacity", usd::text(look.color.w() * (1 - look.transmission)),
            parts_.has_alpha(look.base_color_texture), "Texture", "a") +
      fmt::format("float inputs:ior = {}\n", usd::text(look.refraction));
  if (look.alpha_cutoff > 0)
    out += fmt::format("float inputs:opacityThreshold = {}\n", usd::text(look.alpha_cutoff));
  if (look.normal_texture.image >= 0) out += input("normal3f", "normal", {}, true, "NormalTexture", "rgb");
  if (look.occlusion_texture.image >= 0)
    out += input("float", "occlusion", {}, true, "OcclusionTexture", "r");
  if (look.clearcoat > 0)
    out += fmt::format("float inputs:clearcoat = {}\nfloat inputs:clearcoatRoughness = {}\n",
                       usd::text(look.clearcoat), usd::text(look.clearcoat_roughness));
  return out;
}

std::vector<UsdLooks::Node> UsdLooks::nodes(const render::Material& look) {
  std::vector<Node> result;
  const auto add = [&](Node node) {
    if (node.map.image >= 0) result.push_back(std::move(node));
  };
  Vector4f base = look.color, emission;
  base.w() *= 1 - look.transmission;
  emission << look.emission, 1;
  add({"Texture", look.base_color_texture, true, base});
  add({"EmissionTexture", look.emission_texture, true, emission});
  add({"SurfaceTexture", look.metallic_roughness_texture, false, {1, look.roughness, look.metallic, 1}});
  const float slope = look.normal_scale, shade = look.occlusion_strength;
  add({"NormalTexture", look.normal_texture, false, {2 * slope, 2 * slope, 2, 1}, {-slope, -slope, -1, 0}});
  add({"OcclusionTexture",
       look.occlusion_texture,
       false,
       {shade, shade, shade, 1},
       {1 - shade, 1 - shade, 1 - shade, 0}});
  return result;
}

/// Writes the picture of a texture, and returns its nodes.
std::string UsdLooks::texture(const render::Material& look, const std::string& material,
                              const Node& node) const {
  const std::string path = "/World/Materials/" + material;
  std::string kind = node.name.substr(0, node.name.size() - std::string("Texture").size());
  if (!kind.empty()) kind += '.';
  const std::string picture = fmt::format("{}.{}.{}png", stem_, material, kind);
  render::write_png(folder_ / picture, *parts_.texture(node.map));
  const UvTransform transform = uv_transform(look, node.map);
  std::string out = fmt::format(
      "def Shader \"{}Coordinates\"\n{{\nuniform token info:id = \"UsdPrimvarReader_float2\"\n"
      "string inputs:varname = \"{}\"\nfloat2 outputs:result\n}}\n",
      node.name, node.map.uv_set == 0 ? "st" : "st1");
  if (!transform.is_identity()) out += transform_node(transform, path, node.name);
  return out +
         fmt::format(
             "def Shader \"{0}\"\n{{\nuniform token info:id = \"UsdUVTexture\"\n"
             "asset inputs:file = @./{1}@\nfloat2 inputs:st.connect = <{2}/{0}{3}.outputs:result>\n"
             "token inputs:wrapS = \"{4}\"\ntoken inputs:wrapT = \"{5}\"\n"
             "token inputs:sourceColorSpace = \"{6}\"\nfloat4 inputs:scale = {7}\nfloat4 inputs:bias = {8}\n"
             "float outputs:r\nfloat outputs:g\nfloat outputs:b\nfloat outputs:a\nfloat3 outputs:rgb\n}}\n",
             node.name, picture, path, transform.is_identity() ? "Coordinates" : "Transform",
             wrap_name(node.map.wrap_u), wrap_name(node.map.wrap_v), node.is_color ? "sRGB" : "raw",
             four(node.scale), four(node.bias));
}

}  // namespace offstage::producer
