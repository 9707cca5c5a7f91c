#pragma once
/// What decides about the bits of a picture besides the scene: GL, C library, processor class, compiler.
/// Golden images made under one fingerprint are compared exactly under the same, and within a tolerance under
/// another.

#include <string>

#include "render/context.h"

namespace offstage::producer {

/// "x86-64-v3 AuthenticAMD" or "other ...".
std::string cpu_class();

std::string fingerprint(const render::ContextInfo& context);

/// Processors this process may use (its affinity), at least 1.
int available_processors();

}  // namespace offstage::producer
