#pragma once
/// One self-contained HTML page about a run: pictures, plots, settings and hashes.

#include <string>

#include "producer/format/scene_io.h"
#include "producer/run/production.h"

namespace offstage::producer {

/// `settings`: settings_key(). The stats must be those of a job with `report`.
std::string run_report(const LoadedScene& loaded, const std::string& settings, const RunStats& stats);

}  // namespace offstage::producer
