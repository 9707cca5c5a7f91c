#pragma once
/// The fingerprint of a machine: the properties, besides the scene, that determine the bits of a picture.
/// These are GL, C library, processor class and compiler. Golden images are compared exactly if the
/// fingerprints are equal, otherwise within a tolerance.

#include <string>

#include "render/context.h"

namespace offstage::producer {

/// "x86-64-v3 AuthenticAMD" or "other ...".
std::string cpu_class();

std::string fingerprint(const render::ContextInfo& context);

/// Number of processors that this process may use (its affinity), at least 1.
int available_processors();

}  // namespace offstage::producer
