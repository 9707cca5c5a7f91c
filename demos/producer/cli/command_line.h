#pragma once
/// The command line: offstage new | tune | render | encode | frame | sheet | sweep | simulate | validate |
/// schema | presets | info | compare | bless | doctor | man | completion | bench; and offstage SCENE.json,
/// which renders SCENE.mp4.

#include "producer/cli/commands.h"

namespace offstage::producer {

/// Exit codes, as --help lists them. An interrupted run ends with 128 + the signal's number.
enum ExitCode {
  kOk = 0,
  kRunFailed = 1,
  kUsage = 2,
  kSceneInvalid = 3,
  kUnavailable = 4,  ///< GL, ffmpeg or an encoder
  kDiverged = 5,
  kImagesDiffer = 6,
};

/// Parses the arguments and runs the command; returns the exit code. Results go to standard output, messages
/// to standard error.
int run(int argc, char** argv, const TuneCommand& tune, const WatchCommand& watch);

}  // namespace offstage::producer
