#pragma once
/// The fingerprint of a machine. The bits of a picture depend on the scene and on the machine's GL, C
/// library, class of processor and compiler. The fingerprint names these four. Golden images are compared
/// exactly if the fingerprints are equal, otherwise within a tolerance.

#include <string>

#include "render/context.h"

namespace offstage::producer {

/// Returns the instruction set and the vendor of the processor, such as "x86-64-v3 AuthenticAMD". A processor
/// without AVX2, BMI and FMA is "other VENDOR".
std::string cpu_class();

/// Returns the fingerprint of this machine, for pictures that a GL context draws.
std::string fingerprint(const render::ContextInfo& context);

/// Returns the number of processors that this process may use, according to its affinity; at least 1.
int available_processors();

}  // namespace offstage::producer
