#pragma once
/// The version of this program; defined in a file that cmake/version.cmake writes.

#include <string_view>

namespace offstage::producer {

/// "0.1.0"
std::string_view version();
/// "0.1.0 (commit 9e8ad74bd0c1)", with "-modified" after the commit if the source had changes; without the
/// commit if the source is not under Git.
std::string_view version_text();
/// Folder of the sources at build time, for a program that was not installed.
std::string_view source_folder();

}  // namespace offstage::producer
