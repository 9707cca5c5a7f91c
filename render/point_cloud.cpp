#include "render/point_cloud.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "render/error.h"
#include "render/tone_map.h"

namespace offstage::render {
namespace {

/// Reads lines and words from a text.
class Text {
 public:
  explicit Text(std::string_view text) : rest_(text) {}

  /// Returns the next line without its line end; nothing at the end of the text.
  std::optional<std::string_view> line() {
    if (rest_.empty()) return {};
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    std::string_view result = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    if (result.ends_with('\r')) result.remove_suffix(1);
    return result;
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

std::string_view next_field(std::string_view& line) {
  constexpr std::string_view kBlanks = " \t";
  line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

std::optional<double> next_number(std::string_view& line) {
  std::string_view word = next_field(line);
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error != std::errc() || end != word.data() + word.size()) return {};
  return value;
}

std::string_view text_of(std::span<const uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Adds a point with a colour in sRGB, unless it is not finite.
void add_point(const Vector3f& position, const std::optional<Vector4f>& srgb, PointCloud& cloud) {
  if (!position.allFinite()) return;
  cloud.positions.push_back(position);
  if (!srgb) return;
  Vector4f color = srgb->cwiseMax(0.f).cwiseMin(1.f);
  for (int k = 0; k < 3; ++k) color[k] = srgb_decode(color[k]);
  cloud.colors.push_back(color);
}

enum class PlyNumber { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::optional<PlyNumber> ply_number(std::string_view name) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames = {{{"char", "int8"},
                                                                      {"uchar", "uint8"},
                                                                      {"short", "int16"},
                                                                      {"ushort", "uint16"},
                                                                      {"int", "int32"},
                                                                      {"uint", "uint32"},
                                                                      {"float", "float32"},
                                                                      {"double", "float64"}}};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (name == kNames[i][0] || name == kNames[i][1]) return static_cast<PlyNumber>(i);
  return {};
}

std::size_t bytes_of(PlyNumber type) {
  constexpr std::array<std::size_t, 8> kBytes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

template <class T>
double ply_value_as(const uint8_t* bytes, bool big_endian) {
  std::array<uint8_t, sizeof(T)> own;
  std::memcpy(own.data(), bytes, sizeof(T));
  if (big_endian) std::reverse(own.begin(), own.end());
  return static_cast<double>(std::bit_cast<T>(own));
}

double ply_value(const uint8_t* bytes, PlyNumber type, bool big_endian) {
  switch (type) {
    case PlyNumber::int8:
      return ply_value_as<int8_t>(bytes, big_endian);
    case PlyNumber::uint8:
      return ply_value_as<uint8_t>(bytes, big_endian);
    case PlyNumber::int16:
      return ply_value_as<int16_t>(bytes, big_endian);
    case PlyNumber::uint16:
      return ply_value_as<uint16_t>(bytes, big_endian);
    case PlyNumber::int32:
      return ply_value_as<int32_t>(bytes, big_endian);
    case PlyNumber::uint32:
      return ply_value_as<uint32_t>(bytes, big_endian);
    case PlyNumber::float32:
      return ply_value_as<float>(bytes, big_endian);
    case PlyNumber::float64:
      return ply_value_as<double>(bytes, big_endian);
  }
  return 0;
}

/// Returns the number of this type that stands for a colour of 1.
float full_color(PlyNumber type) {
  return type == PlyNumber::uint8 ? 255.0f : type == PlyNumber::uint16 ? 65535.0f : 1.0f;
}

struct PlyProperty {
  std::string name;
  PlyNumber type;
};

struct PlyHeader {
  enum class Form { text, little, big } form = Form::text;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;  ///< properties of the vertices
};

PlyHeader read_ply_header(Text& text) {
  constexpr int kMostLines = 10'000;
  PlyHeader header;
  bool in_vertices = false, seen = false;
  if (text.line().value_or("") != "ply") throw FileError("is not a PLY file");
  for (int i = 0; i < kMostLines; ++i) {
    const std::optional<std::string_view> line = text.line();
    if (!line) throw FileError("its header has no end");
    std::string_view words = *line;
    const std::string_view first = next_field(words);
    if (first == "end_header") {
      if (!seen) throw FileError("has no vertices");
      return header;
    }
    if (first == "format") {
      const std::string_view form = next_field(words);
      if (form != "ascii" && form != "binary_little_endian" && form != "binary_big_endian")
        throw FileError("has the unknown format '" + std::string(form) + "'");
      header.form = form == "ascii"                  ? PlyHeader::Form::text
                    : form == "binary_little_endian" ? PlyHeader::Form::little
                                                     : PlyHeader::Form::big;
    } else if (first == "element") {
      const bool is_vertex = next_field(words) == "vertex";
      if (!is_vertex && !seen) throw FileError("has other elements before its vertices");
      in_vertices = is_vertex && !seen;
      if (!in_vertices) continue;
      seen = true;
      const std::optional<double> count = next_number(words);
      if (!count || *count < 0 || *count > static_cast<double>(kMostCloudPoints))
        throw FileError("its number of vertices must be from 0 to " + std::to_string(kMostCloudPoints));
      header.count = static_cast<std::size_t>(*count);
    } else if (first == "property" && in_vertices) {
      const std::string_view type = next_field(words);
      const std::optional<PlyNumber> number = ply_number(type);
      if (!number) throw FileError("a vertex has a property of the type '" + std::string(type) + "'");
      header.properties.push_back({std::string(next_field(words)), *number});
    }
  }
  throw FileError("its header is too long");
}

/// The columns of the properties, found by name. Throws if coordinates are missing.
struct PlyColumns {
  std::array<std::size_t, 3> position;
  std::optional<std::array<std::size_t, 3>> color;
  std::optional<std::size_t> alpha;

  explicit PlyColumns(const std::vector<PlyProperty>& properties) {
    const auto find = [&](std::string_view name) {
      const auto found = std::ranges::find(properties, name, &PlyProperty::name);
      return static_cast<std::size_t>(found - properties.begin());
    };
    position = {find("x"), find("y"), find("z")};
    if (std::ranges::max(position) == properties.size()) throw FileError("its vertices have no x, y and z");
    const std::array<std::size_t, 3> rgb = {find("red"), find("green"), find("blue")};
    if (std::ranges::max(rgb) == properties.size()) return;
    color = rgb;
    if (find("alpha") < properties.size()) alpha = find("alpha");
  }
};

}  // namespace

PointCloud parse_ply_points(std::span<const uint8_t> bytes) {
  Text text(text_of(bytes));
  const PlyHeader header = read_ply_header(text);
  const PlyColumns columns(header.properties);
  std::size_t stride = 0;
  for (const PlyProperty& property : header.properties) stride += bytes_of(property.type);
  const bool binary = header.form != PlyHeader::Form::text;
  if (binary && text.rest().size() / stride < header.count) throw FileError("is cut short");
  const auto* next = reinterpret_cast<const uint8_t*>(text.rest().data());
  PointCloud cloud;
  std::vector<double> values(header.properties.size());
  for (std::size_t i = 0; i < header.count; ++i) {
    std::string_view line;
    if (!binary) {
      const std::optional<std::string_view> whole = text.line();
      if (!whole) throw FileError("is cut short");
      line = *whole;
    }
    for (std::size_t k = 0; k < values.size(); ++k) {
      const PlyNumber type = header.properties[k].type;
      if (binary) {
        values[k] = ply_value(next, type, header.form == PlyHeader::Form::big);
        next += bytes_of(type);
        continue;
      }
      const std::optional<double> value = next_number(line);
      if (!value) throw FileError("vertex " + std::to_string(i) + " is not a line of numbers");
      values[k] = *value;
    }
    std::optional<Vector4f> color;
    const auto fraction = [&](std::size_t k) {
      return static_cast<float>(values[k]) / full_color(header.properties[k].type);
    };
    if (columns.color) {
      const auto& [r, g, b] = *columns.color;
      color =
          Vector4f(fraction(r), fraction(g), fraction(b), columns.alpha ? fraction(*columns.alpha) : 1.0f);
    }
    const auto& [x, y, z] = columns.position;
    add_point(Eigen::Vector3d(values[x], values[y], values[z]).cast<float>(), color, cloud);
  }
  return cloud;
}

PointCloud parse_obj_points(std::span<const uint8_t> bytes) {
  Text text(text_of(bytes));
  PointCloud cloud;
  bool all_colored = true;
  while (const std::optional<std::string_view> line = text.line()) {
    std::string_view words = *line;
    if (next_field(words) != "v") continue;
    if (cloud.positions.size() >= kMostCloudPoints)
      throw FileError("has more than " + std::to_string(kMostCloudPoints) + " vertices");
    std::array<std::optional<double>, 6> numbers;
    for (std::optional<double>& number : numbers) number = next_number(words);
    const auto are_given = [&](std::size_t from) {
      return std::all_of(numbers.begin() + from, numbers.begin() + from + 3,
                         [](const auto& n) { return n.has_value(); });
    };
    if (!are_given(0)) throw FileError("a vertex has fewer than three numbers");
    const Vector3f position = Eigen::Vector3d(*numbers[0], *numbers[1], *numbers[2]).cast<float>();
    std::optional<Vector4f> color;
    if (are_given(3)) color = Eigen::Vector4d(*numbers[3], *numbers[4], *numbers[5], 1).cast<float>();
    all_colored &= color.has_value();
    add_point(position, color, cloud);
  }
  if (!all_colored) cloud.colors.clear();
  return cloud;
}

}  // namespace offstage::render
