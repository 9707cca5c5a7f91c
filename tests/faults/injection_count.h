#pragma once
/// The number of times a fault is injected.

#include <algorithm>
#include <cstdlib>

namespace offstage::test {

/// `usual`, multiplied by OFFSTAGE_FAULTS_FACTOR, which the tests with the label "long" set.
inline int tries_of(int usual) {
  const char* factor = std::getenv("OFFSTAGE_FAULTS_FACTOR");
  return usual * (factor ? std::max(1, std::atoi(factor)) : 1);
}

}  // namespace offstage::test
