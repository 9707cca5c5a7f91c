#pragma once
/// How often a fault is injected.

#include <algorithm>
#include <cstdlib>

namespace offstage::test {

/// `usual` in the tests of every change; OFFSTAGE_FAULTS_FACTOR times as often behind the label "long".
inline int tries_of(int usual) {
  const char* factor = std::getenv("OFFSTAGE_FAULTS_FACTOR");
  return usual * (factor ? std::max(1, std::atoi(factor)) : 1);
}

}  // namespace offstage::test
