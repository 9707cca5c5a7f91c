#pragma once
/// A film in steps that other machines can take: one simulation, many drawings of parts, one encoding. Each
/// step is a shell script that can be run again at any time, so a queue system needs to know nothing of
/// films.

#include <filesystem>
#include <string>
#include <vector>

namespace offstage::producer {

struct FarmPlan {
  std::filesystem::path program, scene, out, work;  ///< absolute
  std::vector<std::string> simulate_options;        ///< of `simulate`: what changes the motion
  std::vector<std::string> render_options;          ///< of `render`: these and what changes the picture
  std::string key;                                  ///< of the simulation and of the pictures
  int chunks = 8, retries = 2, threads = 0;         ///< threads 0: all of the machine
  bool encodes = true;                              ///< false: the frames are the output
  std::filesystem::path frames() const { return encodes ? work / "frames" / "####.png" : out; }
};

/// Options of sbatch.
struct SlurmOptions {
  std::string partition, account, time;
  std::vector<std::string> more;  ///< as they are
};

/// One script of the folder `work`, by its name there.
struct FarmScript {
  std::string name, text;
};
/// simulate.sh, chunk.sh (the number of the chunk is its argument, or SLURM_ARRAY_TASK_ID), encode.sh.
std::vector<FarmScript> step_scripts(const FarmPlan& plan);
/// submit.sh: hands the steps to Slurm with their dependencies and writes the numbers of the jobs to the file
/// `jobs`.
FarmScript slurm_script(const FarmPlan& plan, const SlurmOptions& slurm, const std::vector<int>& chunks);

/// How far a farm is, by its folder.
struct FarmState {
  bool simulated = false, encoded = false;
  std::vector<int> missing;  ///< chunks that are not done
  int frames = 0;            ///< files that are there
};
FarmState farm_state(const FarmPlan& plan);

/// "farm.json" in the folder: what --resume and --status need. Throws FileError.
void write_farm(const FarmPlan& plan);
FarmPlan read_farm(const std::filesystem::path& work);

/// A word for the shell, in quotes where it needs them.
std::string shell_word(const std::string& word);

}  // namespace offstage::producer
