#pragma once
/// Properties that determine the bits of a picture besides the scene: GL, C library, processor class,
/// compiler. Golden images are compared exactly under the same fingerprint, and within a tolerance under
/// another one.

#include <string>

#include "render/context.h"

namespace offstage::producer {

/// "x86-64-v3 AuthenticAMD" or "other ...".
std::string cpu_class();

std::string fingerprint(const render::ContextInfo& context);

/// Number of processors that this process may use (its affinity), at least 1.
int available_processors();

}  // namespace offstage::producer
