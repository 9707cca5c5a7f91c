#pragma once
/// Dense least squares by QR factorisations, whose templates take seconds to compile.

#include <Eigen/Core>

#include "sim/core/types.h"

namespace offstage::sim {

/// A solution of least |A x - b|; A has full rank.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// The shortest of all solutions of least |A x - b|; pivots below `rank` of the greatest count as zero.
Eigen::VectorXd shortest_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Real rank);

}  // namespace offstage::sim
