#pragma once
/// Distributes a film over many machines in three steps: simulation, drawing in chunks, and encoding. Each
/// step is a shell script that can be repeated at any time, so any job scheduler can run it.

#include <filesystem>
#include <string>
#include <vector>

namespace offstage::producer {

struct FarmPlan {
  std::filesystem::path program, scene, out, work;  ///< absolute
  std::vector<std::string> simulate_options;        ///< options of `simulate`, which affect the motion
  std::vector<std::string> render_options;   ///< of `render`: simulate_options, and options of the picture
  std::string key;                           ///< hash of the settings of the simulation and of the pictures
  int chunks = 8, retries = 2, threads = 0;  ///< threads 0: all available
  bool encodes = true;                       ///< false: the frames are the output
  std::filesystem::path frames() const { return encodes ? work / "frames" / "####.png" : out; }
};

/// Options of sbatch.
struct SlurmOptions {
  std::string partition, account, time;
  std::vector<std::string> more;  ///< further options, passed on unchanged
};

/// A script in the folder `work`, with its file name.
struct FarmScript {
  std::string name, text;
};
/// Returns simulate.sh, chunk.sh (its argument, or SLURM_ARRAY_TASK_ID, is the number of the chunk) and
/// encode.sh.
std::vector<FarmScript> step_scripts(const FarmPlan& plan);
/// Returns submit.sh, which submits the steps to Slurm with their dependencies and writes the job numbers to
/// the file `jobs`.
FarmScript slurm_script(const FarmPlan& plan, const SlurmOptions& slurm, const std::vector<int>& chunks);

/// Progress of a farm, according to its folder.
struct FarmState {
  bool simulated = false, encoded = false;
  std::vector<int> missing;  ///< unfinished chunks
  int frames = 0;            ///< number of existing frames
};
FarmState farm_state(const FarmPlan& plan);

/// Writes and reads "farm.json" in the folder, which --resume and --status need. Both throw FileError.
void write_farm(const FarmPlan& plan);
FarmPlan read_farm(const std::filesystem::path& work);

/// Quotes a word for the shell if necessary.
std::string shell_word(const std::string& word);

}  // namespace offstage::producer
