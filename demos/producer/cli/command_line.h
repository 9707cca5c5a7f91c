#pragma once
/// The command line. `offstage COMMAND ...` runs a command; commands.h declares all commands. `offstage
/// SCENE.json` renders SCENE.mp4.

#include "producer/cli/commands.h"

namespace offstage::producer {

/// Exit codes, which --help lists. A run that a signal interrupts ends with 128 + the number of the signal.
enum ExitCode {
  kOk = 0,
  kRunFailed = 1,
  kUsage = 2,
  kSceneInvalid = 3,
  kUnavailable = 4,  ///< GL, ffmpeg or an encoder is not available
  kDiverged = 5,
  kImagesDiffer = 6,
};

/// Parses the arguments, runs the command, and returns the exit code. Prints results to standard output, and
/// messages to standard error. `tune` and `watch` are functions of libraries that depend on this one.
int run(int argc, char** argv, const TuneCommand& tune, const WatchCommand& watch);

}  // namespace offstage::producer
