#pragma once
/// `offstage tune`: the tuning page.

#include "producer/cli/commands.h"

namespace offstage::tune {

/// Serves the page of a scene until a signal ends it, and prints its address. Returns an exit code.
int tune_command(const producer::TuneOptions& options);

}  // namespace offstage::tune
