#pragma once
/// A square root of the mobility of a body with joints.

#include <Eigen/Eigenvalues>

#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

/// Returns L for which L L^T is the mobility. Joints make a mobility singular: it has no inverse, but a root.
inline Mat6 mobility_root(const Mat6& mobility) {
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen((mobility + mobility.transpose()) / 2);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

}  // namespace offstage::sim
