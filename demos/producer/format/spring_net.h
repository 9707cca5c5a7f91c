#pragma once
/// Greatest natural frequency of connected springs, for scene_check.h.

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "producer/scene/values.h"

namespace offstage::producer {

/// Springs at their places of time 0, with the objects at their ends as point masses. Rotation of the objects
/// only increases the rates.
class SpringNet {
 public:
  struct End {
    std::string object;  ///< name of the body or particle; empty: the world
    Real mass = 0;       ///< [kg]; infinite: the object does not move
    Vec3 place;          ///< [m]
  };
  /// `spring`: a number by which results name the spring. `stiffness`: [N/m].
  void add(std::size_t spring, const End& a, const End& b, Real stiffness);

  /// The fastest motion of the net.
  struct Fastest {
    /// Lower bound of the greatest eigenvalue of stiffness by mass [1/s^2], by 40 power iterations. 0: there
    /// are no springs.
    Real rate = 0;
    std::size_t spring = 0;  ///< the spring with the greatest part of it
  };
  Fastest stiffest() const;

 private:
  struct Link {
    std::size_t spring;
    std::size_t a, b;  // indices of objects; 0: does not move
    Vec3 along;        // unit
    Real stiffness;
  };
  std::size_t object(const End& end);

  std::map<std::string, std::size_t> numbers_;
  std::vector<Real> inverse_masses_ = {0};
  std::vector<Link> links_;
};

}  // namespace offstage::producer
