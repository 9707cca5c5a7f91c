#pragma once
/// Dense least squares by QR factorizations. They are in a file of their own, because their templates take
/// seconds to compile.

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

/// Returns the x that minimizes |A x - b|; A must have full rank.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// Returns the shortest x that minimizes |A x - b|. Pivots below `rank` times the greatest pivot count as
/// zero.
Eigen::VectorXd shortest_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Real rank);

}  // namespace offstage::sim
