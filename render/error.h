#pragma once
/// Exceptions of the renderer. Each message is one line that says what failed and how to fix it.

#include <stdexcept>
#include <string>

namespace offstage::render {

/// A file cannot be read or written, or its content is invalid.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// OSMesa, EGL, a GL feature, ffmpeg or an encoder is missing or failed. The message names the Debian
/// package.
class UnavailableError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

<<<<<<< ours
=======
/// A wait ended early because of a request to stop.
class StoppedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

>>>>>>> theirs
}  // namespace offstage::render
