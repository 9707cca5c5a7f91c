#include "producer/run/farm.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/json_file.h"
#include "render/error.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

constexpr int kFarmFormat = 1;
constexpr int kMostChunks = 10'000;

std::string command_text(const FarmPlan& plan, const std::vector<std::string>& words) {
  std::string text = shell_word(plan.program.string());
  for (const std::string& word : words) text += " " + shell_word(word);
  if (plan.threads > 0 && words.front() != "encode") text += fmt::format(" --threads {}", plan.threads);
  return text;
}

/// Returns the common beginning of all scripts.
std::string head(const FarmPlan& plan, const std::string& title) {
  return fmt::format(
      "#!/bin/sh\n# {}: {}\nset -eu\ncd {}\nmkdir -p done\n"
      "# Runs a command again when it fails.\n"
      "try() {{\n  attempt=0\n  until \"$@\"; do\n    attempt=$((attempt + 1))\n"
      "    [ $attempt -le {} ] || return 1\n"
      "    echo \"attempt $attempt failed, trying again\" >&2\n    sleep 1\n  done\n}}\n",
      plan.out.filename().string(), title, shell_word(plan.work.string()), plan.retries);
}

}  // namespace

std::string shell_word(const std::string& word) {
  const auto plain = [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-' || c == '.' || c == '/' || c == ':' || c == '=' ||
           c == ',' || c == '+' || c == '%';
  };
  if (!word.empty() && std::ranges::all_of(word, plain)) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

std::vector<FarmScript> step_scripts(const FarmPlan& plan) {
  std::vector<std::string> simulate = {"simulate", plan.scene.string()};
  simulate.insert(simulate.end(), plan.simulate_options.begin(), plan.simulate_options.end());
  for (const char* word :
       {"--cache", "cache", "--stats", "simulate-stats.json", "--force", "--progress", "plain"})
    simulate.emplace_back(word);
  std::vector<std::string> render = {"render", plan.scene.string()};
  render.insert(render.end(), plan.simulate_options.begin(), plan.simulate_options.end());
  render.insert(render.end(), plan.render_options.begin(), plan.render_options.end());
  for (const std::string& word :
       {std::string("--cache"), std::string("cache"), std::string("-o"), plan.frames().string(),
        std::string("--resume"), std::string("--progress"), std::string("plain")})
    render.push_back(word);

  std::vector<FarmScript> scripts;
  scripts.push_back({"simulate.sh", head(plan, "simulates the film once, for all chunks") +
                                        "[ ! -e done/simulate ] || exit 0\ntry " +
                                        command_text(plan, simulate) + "\ntouch done/simulate\n"});
  // With --resume, finished frames of the chunk are kept, and partial files of a crashed machine are drawn
  // again.
  scripts.push_back(
      {"chunk.sh", head(plan, "draws one part of the frames") + "chunk=${1:-$SLURM_ARRAY_TASK_ID}\ntry " +
                       command_text(plan, render) +
                       fmt::format(" --chunk \"$chunk/{}\"\ntouch \"done/chunk-$chunk\"\n", plan.chunks)});
  std::string last = head(plan, "makes the video, when all chunks are done");
  last += fmt::format(
      "for chunk in $(seq 1 {}); do\n  [ -e \"done/chunk-$chunk\" ] || "
      "{{ echo \"chunk $chunk is not done\" >&2; exit 1; }}\ndone\n",
      plan.chunks);
  if (plan.encodes)
    last += "try " +
            command_text(plan, {"encode", plan.frames().string(), "-o", plan.out.string(), "--force",
                                "--progress", "plain"}) +
            "\n";
  scripts.push_back({"encode.sh", last + "touch done/film\n"});
  return scripts;
}

FarmScript slurm_script(const FarmPlan& plan, const SlurmOptions& slurm, const std::vector<int>& chunks) {
  std::string options = "--parsable --requeue --kill-on-invalid-dep=yes --open-mode=append";
  if (!slurm.partition.empty()) options += " --partition=" + shell_word(slurm.partition);
  if (!slurm.account.empty()) options += " --account=" + shell_word(slurm.account);
  if (!slurm.time.empty()) options += " --time=" + shell_word(slurm.time);
  if (plan.threads > 0) options += fmt::format(" --cpus-per-task={}", plan.threads);
  for (const std::string& word : slurm.more) options += " " + shell_word(word);
  const std::string name = plan.out.stem().string();
  const auto job = [&](const char* step, const std::string& more) {
    return fmt::format("$(sbatch {} --job-name={} --output=logs/{}{}.log {}{}.sh)", options,
                       shell_word(name + "-" + step), step, std::string_view(step) == "chunk" ? "-%a" : "",
                       more, step);
  };
  std::string array;
  for (const int chunk : chunks) array += (array.empty() ? "" : ",") + std::to_string(chunk);
  std::string text =
      fmt::format("#!/bin/sh\n# {}: submits the steps to Slurm.\nset -eu\ncd {}\nmkdir -p logs\n",
                  plan.out.filename().string(), shell_word(plan.work.string()));
  text += "simulate=" + job("simulate", "") + "\n";
  std::string before_encoding = "$simulate";
  if (!chunks.empty()) {
    text += "chunks=" + job("chunk", "--dependency=afterok:$simulate --array=" + array + " ") + "\n";
    before_encoding = "$chunks";
  }
  text += "encode=" + job("encode", "--dependency=afterok:" + before_encoding + " ") + "\n";
  text += fmt::format("echo \"$simulate {} $encode\" >jobs\ncat jobs\n", chunks.empty() ? "" : "$chunks");
  return {"submit.sh", text};
}

FarmState farm_state(const FarmPlan& plan) {
  FarmState state;
  const fs::path done = plan.work / "done";
  std::error_code error;
  state.simulated = fs::exists(done / "simulate", error);
  state.encoded = fs::exists(done / "film", error) && (!plan.encodes || fs::exists(plan.out, error));
  for (int chunk = 1; chunk <= plan.chunks; ++chunk)
    if (!fs::exists(done / fmt::format("chunk-{}", chunk), error)) state.missing.push_back(chunk);
  for (const auto& entry : fs::directory_iterator(plan.frames().parent_path(), error))
    if (entry.path().extension() == ".png" && !entry.path().filename().string().starts_with("."))
      ++state.frames;
  return state;
}

void write_farm(const FarmPlan& plan) {
  const nlohmann::ordered_json json = {{"offstage_farm", kFarmFormat},
                                       {"program", plan.program.string()},
                                       {"scene", plan.scene.string()},
                                       {"out", plan.out.string()},
                                       {"key", plan.key},
                                       {"chunks", plan.chunks},
                                       {"encodes", plan.encodes}};
  const std::string text = json.dump(2) + "\n";
  render::write_file_atomically(plan.work / "farm.json",
                                {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

FarmPlan read_farm(const fs::path& work) {
  const std::optional<JsonObject> json = read_json_file(work / "farm.json");
  if (!json || json->count("offstage_farm", 0, kMostFrames) != kFarmFormat)
    throw render::FileError(
        work.string() +
        ": is not the folder of a farm; give the folder that `offstage farm` wrote, such as FILM.mp4.farm");
  FarmPlan plan;
  plan.work = fs::absolute(work);
  plan.program = json->text("program");
  plan.scene = json->text("scene");
  plan.out = json->text("out");
  plan.key = json->text("key");
  plan.chunks = json->count("chunks", 1, kMostChunks);
  plan.encodes = json->flag("encodes", true);
  return plan;
}

}  // namespace offstage::producer
