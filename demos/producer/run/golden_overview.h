#pragma once
/// One HTML page about the comparison of many scenes with their goldens.

#include <filesystem>
#include <span>
#include <string>

#include "producer/run/junit.h"

namespace offstage::producer {

struct ReportedScene {
  TestResult result;
  std::string page;  ///< page about the scene, relative to the folder of the report; empty: there is none
};

/// Writes FOLDER/index.html and returns its path. Throws render::FileError.
std::filesystem::path write_report_overview(const std::filesystem::path& folder,
                                            std::span<const ReportedScene> scenes);

}  // namespace offstage::producer
