#pragma once
/// What the renderer throws: one line that says what failed and what to do about it.

#include <stdexcept>
#include <string>

namespace offstage::render {

/// A file that cannot be read or written, or holds what it should not.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// OSMesa and EGL, a GL feature, ffmpeg or an encoder is missing or failed; the message names the Debian
/// package.
class UnavailableError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A wait that was given up after a request to stop.
class StoppedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace offstage::render
