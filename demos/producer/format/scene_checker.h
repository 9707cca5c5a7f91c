#pragma once
/// Base classes of the checks of a scene. They hold the scene and the findings, and check names, files and
/// times.

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "producer/base/scene_folder.h"
#include "producer/base/suggest.h"
#include "producer/format/scene_check.h"

namespace offstage::producer {

template <class T>
std::vector<std::string> names_of(const std::vector<T>& objects) {
  std::vector<std::string> names;
  for (const T& object : objects) names.push_back(object.name);
  return names;
}

template <class T>
const T* find_named(const std::vector<T>& objects, const std::string& name) {
  const auto it = std::find_if(objects.begin(), objects.end(), [&](const T& o) { return o.name == name; });
  return it == objects.end() ? nullptr : &*it;
}

/// Returns an index as a step of a JSON pointer, such as "/3".
inline std::string step(std::size_t i) {
  return "/" + std::to_string(i);
}

/// Collects the findings of a check.
class CheckBase {
 protected:
  explicit CheckBase(Findings& findings) : findings_(findings) {}

  void fail(std::string path, std::string what) {
    findings_.errors.push_back({{"", 0, 0, std::move(path)}, std::move(what)});
  }
  void warn(std::string path, std::string what) {
    findings_.warnings.push_back({{"", 0, 0, std::move(path)}, std::move(what)});
  }

  void check_lifetime(const std::string& path, Real appear_at, Real remove_at) {
    if (!(remove_at > appear_at))
      fail(path + "/remove_at",
           fmt::format("must be later than \"appear_at\" ({:g} s), got {:g} s", appear_at, remove_at));
  }

  Findings& findings_;
};

/// Base class of the checks. `flat` is the scene with its copies expanded.
class SceneChecker : protected CheckBase {
 protected:
  SceneChecker(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings)
      : CheckBase(findings), scene_(scene), flat_(flat), folder_(folder) {
    for (const Body& body : flat.bodies) bodies_.emplace(body.name, &body);
  }

  /// Checks that no two objects of the lists have the same name.
  template <class... T>
  void check_unique(const std::vector<T>&... lists) {
    std::map<std::string, std::string> owners;
    std::set<std::string> reported;
    const auto check = [&](const auto& object) {
      const auto [it, fresh] = owners.emplace(object.name, object.where.path);
      if (fresh || !reported.insert(object.where.path).second) return;
      fail(object.where.path + "/name", "the name '" + object.name + "' is already used by " + it->second);
    };
    (std::ranges::for_each(lists, check), ...);
  }
  void check_body_name(const std::string& path, const std::string& name) {
    if (bodies_.contains(name)) return;
    if (find_named(scene_.bodies, name))
      return fail(path, "the body '" + name + "' has copies; name one of them, such as '" + name + "_0'");
    fail(path, "there is no body '" + name + "'" + suggestion(name, names_of(flat_.bodies)));
  }
  /// Returns the body of that name; reports an error if there is none.
  const Body* named_body(const std::string& path, const std::string& name) {
    check_body_name(path, name);
    const auto body = bodies_.find(name);
    return body == bodies_.end() ? nullptr : body->second;
  }
  void check_file(const std::string& path, const std::string& file) {
    const std::string wrong = file.empty() ? "" : folder_.wrong_file(folder_ / file);
    if (!wrong.empty()) fail(path, wrong);
  }
  template <class Key>
  void check_times(const std::vector<Key>& keys, const std::string& path) {
    for (std::size_t i = 1; i < keys.size(); ++i)
      if (keys[i].time <= keys[i - 1].time)
        fail(path + step(i) + "/time",
             fmt::format("times must increase, got {} after {}", keys[i].time, keys[i - 1].time));
  }

  const Scene& scene_;
  const Scene& flat_;
  const SceneFolder& folder_;
  std::map<std::string, const Body*> bodies_;  // bodies of the flat scene, by name
};

}  // namespace offstage::producer
