#include "producer/format/scene_check_cloths.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "producer/base/shipped_files.h"
#include "producer/base/suggest.h"
#include "producer/build/cloth_defs.h"
#include "producer/format/scene_checker.h"

namespace offstage::producer {
namespace {

class ClothChecker : CheckBase {
 public:
  ClothChecker(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings)
      : CheckBase(findings), scene_(scene), flat_(flat), folder_(folder) {}

  void check(const Cloth& cloth) {
    const std::string& path = cloth.where.path;
    if (!effects::find_fabric(cloth.fabric))
      return fail(path + "/fabric",
                  "there is no fabric '" + cloth.fabric + "'" + suggestion(cloth.fabric, fabric_names()));
    for (const ClothPin& pin : cloth.pins) check_body(scope_of(pin).body, scope_of(pin).where);
    for (const ClothCord& cord : cloth.cords) check_body(cord.body, cord.where);
    check_lifetime(path, cloth.appear_at, cloth.remove_at);
    const FabricChanges& changes = cloth.changes;
    const bool springs = changes.bend_model.value_or(effects::find_fabric(cloth.fabric)->fabric.bend_model) ==
                         effects::BendModel::springs;
    if (changes.bend_spring_damping && !springs)
      fail(path + "/bend_spring_damping",
           "is for the bend_model \"springs\"; \"bend_damping\" damps the bending of a plate");
    if (changes.bend_damping && springs)
      fail(path + "/bend_damping",
           "is for the bend_model \"plate\"; \"bend_spring_damping\" damps the springs between second "
           "neighbours");
    if (const auto* mesh = std::get_if<MeshFile>(&cloth.shape)) {
      const std::string wrong = mesh->file.empty() ? "" : folder_.wrong_file(model_file(mesh->file, folder_));
      if (!wrong.empty()) fail(path + "/shape/file", wrong);
      if (mesh->decomposition)
        fail(path + "/shape/decomposition", "is for bodies; a cloth has no convex parts");
      return;
    }
    try {
      check_shape(cloth, flat_cloth(cloth, nullptr));
    } catch (const std::invalid_argument& error) {
      fail(path, error.what());
    }
  }

 private:
  void check_body(const std::string& body, const Where& where) {
    if (body.empty() || std::ranges::find(flat_.bodies, body, &Body::name) != flat_.bodies.end()) return;
    std::vector<std::string> names;
    for (const Body& known : flat_.bodies) names.push_back(known.name);
    fail(where.path + "/body", "there is no body '" + body + "'" + suggestion(body, names));
  }

  void check_shape(const Cloth& cloth, FlatCloth flat) {
    for (const ClothPin& pin : cloth.pins) {
      const PinScope& scope = scope_of(pin);
      if (scope.where.path.empty()) continue;  // the type of the pin was invalid, so that it was not read
      const std::vector<uint32_t> held = pinned_vertices(pin, cloth, flat);
      if (held.empty()) fail(scope.where.path, selects_nothing(flat));
    }
    if (const std::string what = sim::problem(flat.def); !what.empty()) return fail(cloth.where.path, what);
    if (const auto what = instability_of(scene_, flat.def)) fail(cloth.where.path, *what);
  }

  const Scene& scene_;
  const Scene& flat_;
  const SceneFolder& folder_;
};

}  // namespace

void check_cloths(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings) {
  ClothChecker checker(scene, flat, folder, findings);
  for (const Cloth& cloth : scene.cloths) checker.check(cloth);
}

}  // namespace offstage::producer
