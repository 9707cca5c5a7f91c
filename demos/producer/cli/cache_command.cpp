// The command cache: lists, verifies and clears caches.

#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/run/cache_folder.h"

namespace offstage::producer {
namespace {

struct CacheOptions {
  std::string action;
  std::vector<std::string> folders;
  bool json = false;
};

std::string size_text(uint64_t bytes) {
  return bytes < 10'000'000 ? fmt::format("{} kB", (bytes + 999) / 1000)
                            : fmt::format("{} MB", (bytes + 999'999) / 1'000'000);
}

std::vector<CacheInfo> caches_in(const std::vector<std::string>& folders) {
  std::vector<CacheInfo> all;
  for (const std::string& folder : folders) {
    std::vector<CacheInfo> found = find_caches(folder);
    if (found.empty()) log("note: {} contains no snapshot cache\n", folder);
    all.insert(all.end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
  }
  return all;
}

int list_caches(const CacheOptions& options) {
  auto json = nlohmann::ordered_json::array();
  for (const CacheInfo& cache : caches_in(options.folders)) {
    if (options.json)
      json.push_back({{"folder", cache.folder.string()},
                      {"format", cache.format},
                      {"frames", cache.frames},
                      {"key", cache.key},
                      {"bytes", cache.bytes},
                      {"problem", cache.problem}});
    else
      fmt::print("{}: {} frames, {}, {}\n", cache.folder.string(), cache.frames, size_text(cache.bytes),
                 cache.problem.empty() ? "simulation " + cache.key.substr(0, 12) : cache.problem);
  }
  if (options.json) fmt::print("{}\n", json.dump(2));
  return kOk;
}

int verify_caches(const CacheOptions& options) {
  int code = kOk;
  for (const CacheInfo& cache : caches_in(options.folders)) {
    const std::vector<std::string> problems = verify_cache(cache);
    if (problems.empty()) {
      fmt::print("{}: {} frames, all valid\n", cache.folder.string(), cache.frames);
      continue;
    }
    code = kRunFailed;
    for (const std::string& problem : problems) fmt::print("{}: {}\n", cache.folder.string(), problem);
  }
  return code;
}

int clear_caches(const CacheOptions& options) {
  int code = kOk;
  for (const std::string& folder : options.folders) {
    std::string problem;
    const uint64_t freed = clear_cache(folder, problem);
    fmt::print("{}: removed {}\n", folder, size_text(freed));
    if (problem.empty()) continue;
    log("offstage: {}\n", problem);
    code = kRunFailed;
  }
  return code;
}

/// Lists, verifies or clears folders of snapshots.
int cache_command(const CacheOptions& options) {
  if (options.action == "list") return list_caches(options);
  if (options.action == "verify") return verify_caches(options);
  return clear_caches(options);
}

}  // namespace

Command add_cache(CLI::App& app) {
  const auto options = std::make_shared<CacheOptions>();
  CacheOptions& given = *options;
  CLI::App* command =
      app.add_subcommand("cache", "List, verify or clear folders of snapshots that `simulate --cache` wrote");
  command
      ->add_option("action", given.action,
                   "list: print their contents; verify: read every snapshot; clear: remove the snapshots")
      ->required()
      ->check(CLI::IsMember({"list", "verify", "clear"}));
  command
      ->add_option("folders", given.folders,
                   "Folders with a cache; `list` and `verify` also accept folders that contain several")
      ->required();
  command->add_flag("--json", given.json, "Print the list as JSON");
  return {command, [options] { return cache_command(*options); }};
}

}  // namespace offstage::producer
