#pragma once
/// `offstage render --watch`.

#include "producer/cli/commands.h"

namespace offstage::engine {

/// Renders the scene, and renders it again whenever one of its files changes, until a signal ends the
/// program. A change ends the current render within one frame. States of earlier renders stay in memory, so a
/// change of cameras, lights or materials needs no new simulation. A complete result replaces the output; a
/// failed render keeps the last good result. Returns an exit code.
int watch_command(const producer::RenderOptions& options);

}  // namespace offstage::engine
