#pragma once
/// The version of this program; defined in a file that cmake/version.cmake writes.

#include <string_view>

namespace offstage::producer {

/// Returns the version, such as "0.1.0".
std::string_view version();
/// Returns the version with the Git commit, such as "0.1.0 (commit 9e8ad74bd0c1)". "-modified" follows the
/// commit if the source had changes. Without Git, the commit is missing.
std::string_view version_text();
/// Returns the folder that contained the sources at build time. A program that was not installed finds its
/// files there.
std::string_view source_folder();

}  // namespace offstage::producer
