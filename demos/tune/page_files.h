#pragma once
/// The files of demos/tune/page, embedded at build time.

#include <span>
#include <string_view>

namespace offstage::tune {

struct PageFile {
  std::string_view name;  ///< relative to the folder
  std::string_view bytes;
};

/// Returns all files of the page. cmake/embed_files.cmake generates the function.
std::span<const PageFile> page_files();

}  // namespace offstage::tune
