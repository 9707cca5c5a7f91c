#include "render/mtl_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "render/error.h"
#include "render/file_io.h"
#include "render/model_files.h"

namespace offstage::render {
namespace {

constexpr uint64_t kMaxMtlBytes = uint64_t{256} << 20;
constexpr uint64_t kMaxObjBytes = uint64_t{2} << 30;
constexpr std::size_t kMaxLibraries = 64, kMaxUsedMaterials = 4096;
constexpr std::array kAssimpMtl = {"newmtl", "Ka", "Kd", "Ks",    "Ke",     "Ns",
                                   "Ni",     "d",  "Tr", "illum", "map_Kd", "map_Ke"};
constexpr std::array<std::string_view, 5> kDrawnMtlMaps = {"map_kd", "map_ke", "map_d", "bump", "norm"};
constexpr std::array<std::string_view, 7> kIgnoredMtl = {"decal", "aniso", "anisor", "pc", "pcr", "ps", "tf"};

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Removes the first word from a line and returns it.
std::string_view next_word(std::string_view& line) {
  line = trimmed(line);
  const auto end = static_cast<std::size_t>(std::ranges::find_if(line, is_blank) - line.begin());
  const std::string_view word = line.substr(0, end);
  line = trimmed(line.substr(end));
  return word;
}

std::optional<float> mtl_number(std::string_view word) {
  float value = 0;
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool whole = error == std::errc() && end == word.data() + word.size();
  return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// Reads one to three numbers and returns the first two. A missing second number becomes `missing`.
Eigen::Vector2f next_pair(std::string_view& line, float missing) {
  Eigen::Vector2f result(missing, missing);
  for (int k = 0; k < 3; ++k) {
    std::string_view rest = line;
    const std::optional<float> value = mtl_number(next_word(rest));
    if (!value || rest.empty()) break;  // the last word is the name of the file
    if (k < 2) result[k] = *value;
    line = rest;
  }
  return result;
}

MtlMap read_map(std::string_view line) {
  MtlMap map;
  while (line.starts_with('-')) {
    const std::string option = lower_case(next_word(line));
    if (option == "-s") {
      map.scale = next_pair(line, 1);
    } else if (option == "-o") {
      map.offset = next_pair(line, 0);
    } else if (option == "-t") {
      next_pair(line, 0);
    } else if (option == "-bm") {
      map.bump = mtl_number(next_word(line)).value_or(1);
    } else if (option == "-clamp") {
      map.clamp = lower_case(next_word(line)) == "on";
    } else {
      if (option == "-mm") next_word(line);
      next_word(line);
    }
  }
  line = trimmed(line);
  if (line.size() >= 2 && line.front() == '"' && line.back() == '"') line = line.substr(1, line.size() - 2);
  map.file = std::string(line);
  return map;
}

template <class Each>
void for_each_line(std::string_view text, Each each) {
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    each(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
}

}  // namespace

void read_mtl(const std::string& text, std::map<std::string, MtlMaterial>& materials) {
  MtlMaterial* current = nullptr;
  for_each_line(text, [&](std::string_view line) {
    const std::string key = lower_case(next_word(line));
    if (key == "newmtl") current = &materials[std::string(line)];
    if (current == nullptr) return;
    if (key == "pr") current->roughness = mtl_number(next_word(line));
    if (key == "pm") current->metallic = mtl_number(next_word(line));
    const bool without_effect = key == "tf" && next_pair(line, 1) == Eigen::Vector2f(1, 1);
    if (!without_effect && std::ranges::find(kIgnoredMtl, key) != kIgnoredMtl.end())
      current->ignored.insert(key);
    const bool is_map =
        key.starts_with("map_") || key == "bump" || key == "norm" || key == "disp" || key == "refl";
    if (!is_map) return;
    MtlMap map = read_map(line);
    if (map.file.empty()) return;
    const std::string name = key == "map_bump" ? "bump" : key == "map_norm" ? "norm" : key;
    if (std::ranges::find(kDrawnMtlMaps, name) == kDrawnMtlMaps.end()) current->ignored.insert(name);
    current->maps[name] = std::move(map);
  });
  for (auto& [name, material] : materials) {  // programs write the same picture for the light around
    const auto around = material.maps.find("map_ka"), base = material.maps.find("map_kd");
    if (around != material.maps.end() && base != material.maps.end() &&
        around->second.file == base->second.file)
      material.ignored.erase("map_ka");
  }
}

std::string mtl_for_assimp(const std::string& text) {
  std::string result;
  for_each_line(text, [&](std::string_view line) {
    const std::string key = lower_case(next_word(line));
    const auto known =
        std::ranges::find_if(kAssimpMtl, [&](const char* statement) { return lower_case(statement) == key; });
    if (known == kAssimpMtl.end()) return;
    result += std::string(*known) + " " +
              (key.starts_with("map_") ? read_map(line).file : std::string(line)) + "\n";
  });
  return result;
}

namespace {

/// The names in the statements of an OBJ file that are about materials.
struct MaterialNames {
  std::vector<std::string> libraries, used;  ///< of mtllib and usemtl, each name once
};

MaterialNames material_names(const std::filesystem::path& obj) {
  MaterialNames names;
  const std::vector<uint8_t> bytes = read_file(obj, kMaxObjBytes);
  const auto add = [](std::vector<std::string>& to, std::string_view name, std::size_t most) {
    if (to.size() < most && std::ranges::find(to, name) == to.end()) to.emplace_back(name);
  };
  for_each_line({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, [&](std::string_view line) {
    const std::string_view key = next_word(line);
    if (key == "mtllib") add(names.libraries, line, kMaxLibraries);
    if (key == "usemtl") add(names.used, line, kMaxUsedMaterials);
  });
  return names;
}

}  // namespace

std::map<std::string, MtlMaterial> read_mtl_of(const std::filesystem::path& obj, const InputFolders& folders,
                                               std::vector<std::string>& warnings) {
  std::map<std::string, MtlMaterial> materials;
  const MaterialNames names = material_names(obj);
  bool complete = !names.libraries.empty();
  for (const std::string& name : names.libraries) {
    const std::filesystem::path file = find_beside(obj.parent_path(), name);
    if (file.empty() || !folders.contain(file)) {
      warnings.push_back("the material library '" + name +
                         "' is not found; its materials have the default appearance");
      complete = false;
      continue;
    }
    try {
      const std::vector<uint8_t> text = read_file(file, kMaxMtlBytes);
      read_mtl({text.begin(), text.end()}, materials);
    } catch (const FileError&) {
      complete = false;  // no message here: assimp reads the same file and reports the error
    }
  }
  for (const std::string& name : names.used)
    if (complete && !materials.contains(name))
      warnings.push_back("the material '" + name +
                         "' is in no material library; it has the default appearance");
  return materials;
}

}  // namespace offstage::render
