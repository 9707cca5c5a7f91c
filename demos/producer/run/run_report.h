#pragma once
/// Makes a self-contained HTML page about a run: pictures, plots, settings and hashes.

#include <string>

#include "producer/format/scene_io.h"
#include "producer/run/production.h"

namespace offstage::producer {

/// Returns the page as text. `settings`: the result of settings_key(). `stats` must come from a RenderJob
/// with `report` set.
std::string run_report(const LoadedScene& loaded, const std::string& settings, const RunStats& stats);

}  // namespace offstage::producer
