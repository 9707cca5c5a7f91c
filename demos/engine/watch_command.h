#pragma once
/// `offstage render --watch`.

#include "producer/cli/commands.h"

namespace offstage::engine {

/// Renders, and renders again whenever a file of the scene changes, until a signal ends it. A change ends the
/// current render within one frame. States of earlier renders stay in memory, so that a change of cameras,
/// lights or looks does not simulate again. A complete result replaces the output; a failed render keeps the
/// last good result. Returns an exit code.
int watch_command(const producer::RenderOptions& options);

}  // namespace offstage::engine
