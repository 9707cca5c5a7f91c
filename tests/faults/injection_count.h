#pragma once
/// The number of times a fault is injected.

#include <algorithm>
#include <cstdlib>

namespace offstage::test {

/// Returns `usual` times the environment variable OFFSTAGE_FAULTS_FACTOR, or `usual` if the variable is not
/// set. Tests with the label "long" set it.
inline int tries_of(int usual) {
  const char* factor = std::getenv("OFFSTAGE_FAULTS_FACTOR");
  return usual * (factor ? std::max(1, std::atoi(factor)) : 1);
}

}  // namespace offstage::test
