#pragma once
/// `offstage tune`: the tuning page.

#include "producer/cli/commands.h"

namespace offstage::tune {

/// Serves the tuning page of a scene and prints its address, until a signal ends the program. Returns an exit
/// code.
int tune_command(const producer::TuneOptions& options);

}  // namespace offstage::tune
