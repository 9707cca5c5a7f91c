#pragma once
/// Exceptions of the renderer. Each has one line that says what failed and what to do about it.

#include <stdexcept>
#include <string>

namespace offstage::render {

/// A file cannot be read or written, or its content is invalid.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A library (OSMesa, EGL), a GL feature, ffmpeg or an encoder is missing or failed. The message names the
/// Debian package to install.
class UnavailableError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The work was ended by a request to stop.
class StoppedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace offstage::render
