# Writes OUTPUT, a C++ file that defines the functions of producer/base/version.h, from VERSION and the commit of SOURCE_DIR. Runs in
# every build; OUTPUT stays unchanged if its content would be the same.
set(text "${VERSION}")
find_program(GIT git)
if(GIT AND EXISTS "${SOURCE_DIR}/.git")
  execute_process(COMMAND ${GIT} -C ${SOURCE_DIR} describe --always --abbrev=12 --dirty=-modified --exclude=*
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(commit)
  string(APPEND text " (commit ${commit})")
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT "// Made by cmake/version.cmake.
#include \"producer/base/version.h\"

namespace offstage::producer {
std::string_view version() { return \"${VERSION}\"; }
std::string_view version_text() { return \"${text}\"; }
std::string_view source_folder() { return \"${SOURCE_DIR}\"; }
}  // namespace offstage::producer
")
