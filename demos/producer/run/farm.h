#pragma once
/// Distributes a film over many machines in three steps: simulation, drawing in chunks, and encoding. Each
/// step is a shell script that can be repeated at any time, so any job scheduler can run it.

#include <filesystem>
#include <string>
#include <vector>

namespace offstage::producer {

struct FarmPlan {
  /// Absolute paths: the program offstage, the scene, the output, and the folder of the farm.
  std::filesystem::path program, scene, out, work;
  std::vector<std::string> simulate_options;  ///< options of `simulate`, which affect the motion
  /// Options of `render`: simulate_options, and options that affect only the picture.
  std::vector<std::string> render_options;
  std::string key;  ///< hash of all settings that affect the simulation or the pictures
  /// Number of chunks; number of times that a failed step is repeated; number of threads (0: all available).
  int chunks = 8, retries = 2, threads = 0;
  bool encodes = true;  ///< whether the frames are encoded to a video; false: the frames are the output
  std::filesystem::path frames() const { return encodes ? work / "frames" / "####.png" : out; }
};

/// Options of sbatch.
struct SlurmOptions {
  std::string partition, account, time;
  std::vector<std::string> more;  ///< further options, passed on unchanged
};

/// File name and text of a script in the folder FarmPlan::work.
struct FarmScript {
  std::string name, text;
};
/// Returns the scripts of the three steps: simulate.sh, chunk.sh and encode.sh. chunk.sh takes the number of
/// the chunk from its argument or from the environment variable SLURM_ARRAY_TASK_ID.
std::vector<FarmScript> step_scripts(const FarmPlan& plan);
/// Returns submit.sh. This script submits the steps to Slurm, with their dependencies, and writes the job
/// numbers to the file `jobs`. `chunks`: numbers of the chunks to draw.
FarmScript slurm_script(const FarmPlan& plan, const SlurmOptions& slurm, const std::vector<int>& chunks);

/// Progress of a farm, as the files in its folder show it.
struct FarmState {
  bool simulated = false, encoded = false;
  std::vector<int> missing;  ///< numbers of the unfinished chunks
  int frames = 0;            ///< number of existing frames
};
/// Reads the progress of a farm from its folder.
FarmState farm_state(const FarmPlan& plan);

/// write_farm() writes the plan to "farm.json" in the folder `work`; read_farm() reads it. The options
/// --resume and --status need this file. Both functions throw FileError.
void write_farm(const FarmPlan& plan);
FarmPlan read_farm(const std::filesystem::path& work);

/// Returns a word as it is written in a shell script: in quotes if necessary.
std::string shell_word(const std::string& word);

}  // namespace offstage::producer
