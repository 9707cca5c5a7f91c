#pragma once
/// The version of this program; defined in a file that cmake/version.cmake writes.

#include <string_view>

namespace offstage::producer {

/// "0.1.0"
std::string_view version();
/// "0.1.0 (commit 9e8ad74bd0c1)", with "-modified" behind the commit if the source differed from it; without
/// the commit where the source is not under Git.
std::string_view version_text();
/// Where the sources lay when this was compiled: for a program that was not installed.
std::string_view source_folder();

}  // namespace offstage::producer
