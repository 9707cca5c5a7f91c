#pragma once
/// Contact of cloth with cloth: of points with triangles, and of edges with edges, at the cloths' thickness
/// and with friction.
///
/// Cloth that does not cross itself at the start never crosses itself. A pair cannot have crossed if the sum
/// of its displacements is less than its distance. Any other pair is separated by a plane at the start of the
/// sub-step. If no plane with the same normal separates it at the end, and none with a few other normals
/// separates it at both times, its displacements are shortened.

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_tree.h"
#include "sim/cloth/search_horizon.h"
#include "sim/cloth/stretch_limit.h"

namespace offstage::sim {

class SelfContacts {
 public:
  /// Sets the triangles of the cloths that collide with cloth.
  void assign(std::vector<Triangle> triangles, const ClothPoints& points);
  bool empty() const { return triangles_.empty(); }

  /// After points moved freely in a sub-step of length dt: separates pairs that are closer than their
  /// thickness, and keeps pairs from crossing as far as impulses between two points can. The search for pairs
  /// is repeated only if the known pairs no longer suffice.
  void push_apart(ClothPoints& points, Real dt);
  /// Finds the pairs that may have crossed with the current displacements, or that may cross if any
  /// displacement is shortened towards `drift`. `drift`: for each point, the displacement of the frame in
  /// which it is shortened [m]; it is the same for all points of a piece.
  void find_doubtful(const ClothPoints& points, Real dt, std::span<const Vec4> drift);
  void find_none() { contacts_.clear(); }
  /// Calls visit(points) for each pair found, with its four points. The first belongs to one partner of the
  /// pair, and the last to the other.
  template <class Visit>
  void for_doubtful(Visit&& visit) const {
    for (const Contact& c : contacts_) visit(pairs_[c.pair].points);
  }
  /// Whether any of these pairs crossed.
  bool any_crossed(const ClothPoints& points) const;
  /// Lowers the fractions of the moves of pairs that crossed, and adds their points to `lowered`. Returns
  /// whether there were any.
  bool shorten(const ClothPoints& points, MoveFractions& fractions, std::vector<uint32_t>& lowered);
  /// Records the moves of points for the next search. Call it at the end of a sub-step of length dt [s].
  void end_substep(const ClothPoints& points, Real dt);

  std::span<const uint64_t> active() const {
    return active_;
  }  ///< contacts of the last push_apart(), by cloth
  /// Both functions return points collected since their last call. take_held_back(): points whose
  /// displacements shorten() has shortened. take_crossed(): points of pairs whose crossing could not be
  /// prevented, because pins hold them.
  std::vector<uint32_t> take_held_back() { return std::exchange(held_back_, {}); }
  std::vector<uint32_t> take_crossed() { return std::exchange(crossed_, {}); }

 private:
  /// A point and a triangle, or two edges. The points of the first element come first.
  struct Pair {
    std::array<uint32_t, 4> points;
    bool edges;
    Real thickness;
    Real nearest;            // the pair is kept at least this far apart, unless it is already closer
    Real distance;           // distance at the last check
    Real travel;             // travelled() of the pair at that check
    Eigen::Vector3f normal;  // unit direction from the second element to the first at that check
  };
  struct Contact {
    uint32_t pair;
    std::array<Real, 4> weights;  // weights of the points in the vector between the closest points
    Vec4 normal;                  // unit direction from the second element to the first
    Real distance;                // distance at the start of the sub-step
    bool pushes;                  // if false, contacts of its neighbours push in its place
  };

  /// Two points of a pair and their heights above a plane. Each is the point of its element that is closest
  /// to the other side, or farthest beyond it.
  struct Sides {
    uint32_t first, second;
    Real low, high;
    Real apart() const { return low - high; }
  };

  void find_neighbours(std::size_t point_count);
  std::span<const uint32_t> neighbours(uint32_t point) const {
    return std::span(neighbours_)
        .subspan(first_neighbour_[point], first_neighbour_[point + 1] - first_neighbour_[point]);
  }
  Vec4 normal_at_edge(const ClothPoints& points, uint32_t a, uint32_t b) const;
  std::array<Vec4, 3> other_normals(const ClothPoints& points, const Pair& pair) const;
  bool is_farthest(const ClothPoints& points, std::span<const uint32_t> feature, const Vec4& normal) const;
  bool is_closest(const ClothPoints& points, const Contact& contact) const;
  void keep_thickness(ClothPoints& points);
  void keep_sides(ClothPoints& points);
  bool turn_plane(const ClothPoints& points, Contact& contact, Real least, std::span<const Vec4> drift) const;
  template <class At>
  static Sides sides_of(const Pair& pair, const Vec4& normal, const Vec4& origin, At&& at);
  void predict(const ClothPoints& points, std::size_t i, Real dt);
  void search(const ClothPoints& points, Real dt);
  template <class Wanted>
  void add_pairs(const ClothPoints& points, uint32_t ta, uint32_t tb, Real slack, Wanted&& wanted);
  void add(const ClothPoints& points, const std::array<uint32_t, 4>& p, bool edges, Real slack);
  bool expired(Real dt) const;
  Vec4 off_course(const ClothPoints& points, std::size_t i, Real dt) const;
  bool strayed(const ClothPoints& points, Real dt) const;
  void search_again(const ClothPoints& points, Real dt);
  Real travelled(const Pair& pair) const {
    return travel_[pair.points[0]] + travel_[pair.points[1]] + travel_[pair.points[2]] +
           travel_[pair.points[3]];
  }
  template <class Reach>
  void gather(const ClothPoints& points, Real dt, std::span<const Vec4> drift, Reach&& reach);
  static Real left_between(const ClothPoints& points, const Pair& pair, std::span<const Vec4> drift);
  Contact look(const ClothPoints& points, uint32_t pair);

  std::vector<Triangle> triangles_;
  std::vector<std::array<bool, 3>> owns_point_, owns_edge_;  // by triangle; each has one owner
  std::vector<uint32_t> neighbours_, first_neighbour_;       // by point: the other points of its triangles
  ClothTree tree_;

  std::vector<Pair> pairs_;
  std::vector<Contact> contacts_;  // contacts of the sub-step; after find_doubtful(), the pairs in doubt
  std::vector<uint64_t> active_;
  std::vector<uint32_t> held_back_, crossed_;

  // Since the last search: the predicted paths, and the actual paths.
  Real since_ = 0, horizon_ = -1;
  SearchHorizon length_;
  std::vector<Vec4> predicted_from_, predicted_to_, predicted_velocity_;
  std::vector<Real> travel_, margin_;
  std::vector<Vec4> still_;  // zero drifts
  std::vector<Real> move_;   // by point: length of its move in the sub-step
};

}  // namespace offstage::sim
