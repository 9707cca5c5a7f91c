#pragma once
/// The keys that place copies of bodies and particles.

#include <array>

#include "producer/build/placement.h"
#include "producer/format/table_shape.h"
#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Table<Repeat> {
  static constexpr const char* kName = "repeat";
  static constexpr const char* kHelp =
      "Copies in a row or a ring: copy i is turned by i * turn_deg about the vertical axis through `pivot`, "
      "then moved by i * offset.";
  static Fields<Repeat> fields() {
    return {{"count", &Repeat::count, "number of copies, including the original", "", between(1, kMaxCopies)},
            {"offset", &Repeat::offset, "displacement from one copy to the next", "m"},
            {"turn_deg", &Repeat::turn_deg, "rotation from one copy to the next", "degrees"},
            {"pivot", &Repeat::pivot,
             "a point on the vertical axis about which copies are turned, in the world", "m"}};
  }
};
template <>
struct Table<Grid> {
  static constexpr const char* kName = "grid";
  static constexpr const char* kHelp =
      "Copies on a grid. The grid is centred on the original in x and z, and extends upwards from it in y.";
  static Fields<Grid> fields() {
    return {{"count", &Grid::count, "number of copies along x, y and z", "", between(1, kMaxCopies)},
            {"spacing", &Grid::spacing, "distance between neighbours along x, y and z", "m"}};
  }
};
template <>
struct Table<Scatter> {
  static constexpr const char* kName = "scatter";
  static constexpr const char* kHelp =
      "Copies at random places in a horizontal rectangle centred on the original.";
  static Fields<Scatter> fields() {
    return {{"count", &Scatter::count, "number of copies", "", between(1, kMaxCopies)},
            {"size", &Scatter::size, "size of the rectangle along x and z", "m", kNotNegative},
            {"min_distance", &Scatter::min_distance,
             "least distance between copies; a copy that finds no place is omitted", "m", kNotNegative},
            {"turn", &Scatter::turn,
             "whether each copy is turned by a random angle about the vertical axis through its origin"},
            {"scale", &Scatter::scale, "scale factor of the shape and the model of each copy", "", kScale},
            {"seed", &Scatter::seed, "seed of the random numbers that place the copies", "", kNotNegative}};
  }
};
template <>
struct Table<BoxFill> {
  static constexpr const char* kName = "box_fill";
  static constexpr const char* kHelp = "A cuboid with edges along the axes of the world.";
  static Fields<BoxFill> fields() {
    return {{"size", &BoxFill::size, "full lengths of the edges along x, y and z", "m", kPositive}};
  }
};
template <>
struct Table<CylinderFill> {
  static constexpr const char* kName = "cylinder_fill";
  static constexpr const char* kHelp = "A vertical cylinder.";
  static Fields<CylinderFill> fields() {
    return {{"radius", &CylinderFill::radius, "radius of the cylinder", "m", kPositive},
            {"height", &CylinderFill::height, "height of the cylinder", "m", kPositive}};
  }
};
template <>
struct Table<SphereFill> {
  static constexpr const char* kName = "sphere_fill";
  static constexpr const char* kHelp = "A ball.";
  static Fields<SphereFill> fields() {
    return {{"radius", &SphereFill::radius, "radius of the ball", "m", kPositive}};
  }
};
template <>
struct Table<MeshFill> {
  static constexpr const char* kName = "mesh_fill";
  static constexpr const char* kHelp = "The inside of a closed model, such as a jar.";
  static Fields<MeshFill> fields() {
    return {{"file", &MeshFill::file,
             "model file relative to the scene, or the name of a model that comes with offstage; FILE#NODE "
             "selects one node. The model's origin is at `position`",
             kRequired},
            {"scale", &MeshFill::scale, kModelScaleHelp, "", kScale},
            {"fit", &MeshFill::fit, kModelFitHelp, "m", kPositive}};
  }
};
template <>
struct Tags<std::variant<BoxFill, CylinderFill, SphereFill, MeshFill>> {
  static constexpr const char* kName = "fill_shape";
  static constexpr const char* kHelp = "The volume that is filled.";
  static constexpr std::array kTags = {"box", "cylinder", "sphere", "mesh"};
  static constexpr bool kRequired = false;
};
template <>
struct Names<Packing> {
  static constexpr std::array kNames = {"hexagonal", "cubic", "random"};
};
template <>
struct Table<Fill> {
  static constexpr const char* kName = "fill";
  static constexpr const char* kHelp =
      "Fills a volume with copies of a body, or with particles: a jar of marbles, a pool of drops. All "
      "centres are at least half the spacing inside the volume.";
  static Fields<Fill> fields() {
    return {
        {"shape", &Fill::shape, "volume that is filled"},
        {"position", &Fill::position,
         "centre of the volume: relative to the original, or in the world for a particle group", "m"},
        {"spacing", &Fill::spacing,
         "distance between neighbours; 0: the diameter of the particles. For copies of bodies it must be "
         "given",
         "m", kNotNegative},
        {"packing", &Fill::packing,
         "arrangement of the centres: `hexagonal` is the closest (balls that touch fill 74 %), `cubic` is a "
         "grid (52 %), `random` places them one after the other at random (about 28 %)"},
        {"seed", &Fill::seed, "seed of the random numbers of the `random` arrangement", "", kNotNegative}};
  }
};
template <>
struct Table<Placement> {
  static Fields<Placement> fields() {
    return {{"fill", &Placement::fill, "copies that fill a volume"},
            {"repeat", &Placement::repeat, "copies in a row or a ring"},
            {"grid", &Placement::grid, "copies on a grid"},
            {"scatter", &Placement::scatter, "copies at random places"}};
  }
};

}  // namespace offstage::producer
