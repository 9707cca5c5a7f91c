#include "sim/linear/least_squares.h"

#include <Eigen/QR>

namespace offstage::sim {

Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.colPivHouseholderQr().solve(b);
}

Eigen::VectorXd shortest_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Real rank) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
  qr.setThreshold(rank);
  qr.compute(A);
  return qr.solve(b);
}

}  // namespace offstage::sim
