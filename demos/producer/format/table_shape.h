#pragma once
/// The keys of shapes.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

/// Help texts of the keys `file`, `scale` and `fit` of objects with a model file.
inline constexpr const char* kModelFileHelp =
    "model file relative to the scene, or the name of a model that comes with offstage; FILE#NODE selects "
    "one node";
inline constexpr const char* kModelScaleHelp =
    "scale factor of the model; `auto` converts the likely unit of the file to metres (docs/models.md). "
    "`offstage info FILE` shows the factor";
inline constexpr const char* kModelFitHelp =
    "lengths of the edges of a box along the model's axes. The model gets the largest size that fits into "
    "the box, whatever its unit; `scale` then multiplies that size";

template <>
struct Table<sim::Sphere> {
  static constexpr const char* kName = "sphere";
  static constexpr const char* kHelp = "A ball centred on the body.";
  static Fields<sim::Sphere> fields() {
    return {{"radius", &sim::Sphere::radius, "radius of the ball", "m", kPositive}};
  }
};
template <>
struct Table<sim::Box> {
  static constexpr const char* kName = "box";
  static constexpr const char* kHelp = "A cuboid centred on the body.";
  static Fields<sim::Box> fields() {
    return {{"size", &sim::Box::size, "full lengths of the edges along x, y and z", "m", kPositive}};
  }
};
template <>
struct Table<sim::Capsule> {
  static constexpr const char* kName = "capsule";
  static constexpr const char* kHelp = "A cylinder along y with a hemisphere on each end.";
  static Fields<sim::Capsule> fields() {
    return {{"radius", &sim::Capsule::radius, "radius of the cylinder and the hemispheres", "m", kPositive},
            {"height", &sim::Capsule::height, "distance between the centres of the hemispheres", "m",
             kNotNegative}};
  }
};
template <>
struct Table<sim::Cylinder> {
  static constexpr const char* kName = "cylinder";
  static constexpr const char* kHelp = "A cylinder along y, centred on the body.";
  static Fields<sim::Cylinder> fields() {
    return {{"radius", &sim::Cylinder::radius, "radius of the cylinder", "m", kPositive},
            {"height", &sim::Cylinder::height, "length along y", "m", kPositive}};
  }
};
template <>
struct Table<sim::Cone> {
  static constexpr const char* kName = "cone";
  static constexpr const char* kHelp = "A cone along y: its base at -height/2, its apex at +height/2.";
  static Fields<sim::Cone> fields() {
    return {{"radius", &sim::Cone::radius, "radius of the base", "m", kPositive},
            {"height", &sim::Cone::height, "length along y", "m", kPositive}};
  }
};
template <>
struct Table<sim::Plane> {
  static constexpr const char* kName = "plane";
  static constexpr const char* kHelp =
      "The half-space below y = 0 of the body's frame; not for dynamic bodies.";
  static Fields<sim::Plane> fields() { return {}; }
};
template <>
struct Names<sim::DecompositionMethod> {
  static constexpr std::array kNames = {"auto", "exact", "approximate", "hull"};
};
template <>
struct Table<MeshDecomposition> {
  static constexpr const char* kName = "decomposition";
  static constexpr const char* kHelp =
      "Division of a model into the convex parts with which a dynamic body collides. The mass is computed "
      "from the model itself, not from the parts.";
  static Fields<MeshDecomposition> fields() {
    return {
        {"method", &MeshDecomposition::method,
         "`exact`: exact convex parts if at most 1024 suffice, otherwise approximate parts; `approximate`: "
         "parts that differ from the model by at most `max_error`; `auto`: exact parts if at most "
         "`max_parts` (64) suffice, otherwise approximate parts; `hull`: only the convex hull. A static or "
         "kinematic body without exact parts collides by its triangles, unless the method is `hull`"},
        {"max_error", &MeshDecomposition::max_error,
         "for `approximate`: greatest volume in which the parts and the model may differ, as a fraction of "
         "the model's volume; a larger fraction needs fewer parts",
         "", between(0.001, 1)},
        {"max_parts", &MeshDecomposition::max_parts,
         "greatest number of parts; has priority over `max_error`. Default: 64, and up to 1024 if the error "
         "needs them, as for thin bent shells",
         "", between(1, 1024)},
        {"min_angle_deg", &MeshDecomposition::min_angle_deg,
         "for `exact`: smallest angle between a cut and the faces that it meets; the limit is relaxed if no "
         "cut satisfies it",
         "degrees", between(0, 90)},
        {"min_distance", &MeshDecomposition::min_distance,
         "for `exact`: smallest distance between a cut and the vertices that are not on it, as a fraction of "
         "the mean edge length; the limit is relaxed if no cut satisfies it",
         "", between(0, 1)}};
  }
};
template <>
struct Table<MeshFile> {
  static constexpr const char* kName = "mesh";
  static constexpr const char* kHelp =
      "A model file as a collision shape: its triangles collide and determine the mass.";
  static Fields<MeshFile> fields() {
    return {
        {"file", &MeshFile::file, kModelFileHelp, kRequired},
        {"scale", &MeshFile::scale, kModelScaleHelp, "", kScale},
        {"fit", &MeshFile::fit, kModelFitHelp, "m", kPositive},
        {"decomposition", &MeshFile::decomposition,
         "division into the convex parts with which a dynamic body collides; not for cloths and particles"}};
  }
};
template <>
struct Table<sim::Frustum> {
  static constexpr const char* kName = "frustum";
  static constexpr const char* kHelp = "A cone with its tip cut off, along y, centred on the body.";
  static Fields<sim::Frustum> fields() {
    return {{"radius", &sim::Frustum::radius, "radius of the base at -height/2", "m", kPositive},
            {"top_radius", &sim::Frustum::top_radius, "radius of the top at +height/2", "m", kPositive},
            {"height", &sim::Frustum::height, "length along y", "m", kPositive}};
  }
};
template <>
struct Table<sim::Ellipsoid> {
  static constexpr const char* kName = "ellipsoid";
  static constexpr const char* kHelp = "An ellipsoid centred on the body.";
  static Fields<sim::Ellipsoid> fields() {
    return {{"radii", &sim::Ellipsoid::radii, "half axes along x, y and z", "m", kPositive}};
  }
};
template <>
struct Table<sim::Torus> {
  static constexpr const char* kName = "torus";
  static constexpr const char* kHelp =
      "A ring about y, centred on the body. It collides as 48 convex sectors, which are round on the "
      "outside; its mass is exact.";
  static Fields<sim::Torus> fields() {
    return {
        {"radius", &sim::Torus::radius, "distance of the tube's centre line from the axis", "m", kPositive},
        {"tube_radius", &sim::Torus::tube_radius, "radius of the tube, less than `radius`", "m", kPositive}};
  }
};
template <>
struct Table<sim::Tube> {
  static constexpr const char* kName = "tube";
  static constexpr const char* kHelp =
      "A hollow cylinder along y, open at both ends, centred on the body. It collides as 48 convex sectors, "
      "which are round on the outside and flat on the inside; its mass is exact.";
  static Fields<sim::Tube> fields() {
    return {
        {"radius", &sim::Tube::radius, "radius of the outside", "m", kPositive},
        {"height", &sim::Tube::height, "length along y", "m", kPositive},
        {"thickness", &sim::Tube::thickness, "thickness of the wall, less than `radius`", "m", kPositive}};
  }
};
template <>
struct Table<sim::OpenBox> {
  static constexpr const char* kName = "open_box";
  static constexpr const char* kHelp =
      "A cuboid without its top at +y, centred on the body: a floor and four walls.";
  static Fields<sim::OpenBox> fields() {
    return {{"size", &sim::OpenBox::size, "full lengths of the outside along x, y and z", "m", kPositive},
            {"thickness", &sim::OpenBox::thickness,
             "thickness of the floor and the walls, less than half of the width and less than the height",
             "m", kPositive}};
  }
};
template <>
struct Tags<PartShape> {
  static constexpr const char* kName = "part_shape";
  static constexpr const char* kHelp = "Shape of a part of a compound.";
  static constexpr std::array kTags = {"sphere",  "box",       "capsule", "cylinder", "cone",
                                       "frustum", "ellipsoid", "torus",   "tube",     "open_box"};
  static constexpr bool kRequired = true;
};
template <>
struct Table<CompoundPart> {
  static constexpr const char* kName = "compound_part";
  static constexpr const char* kHelp = "A part of a compound.";
  static Fields<CompoundPart> fields() {
    using T = CompoundPart;
    return {{"shape", &T::shape, "shape of the part"},
            {"position", &T::position, "position of the part in the body's frame", "m"},
            {"orientation", &T::orientation, "orientation of the part in the body's frame"},
            {"density", &T::density, "density of the part; default: the density of the body", "kg/m^3",
             kPositive},
            {"material", &T::material,
             "name of the material with which the part is drawn; empty: the body's material. Friction and "
             "restitution always come from the body's material"}};
  }
};
template <>
struct Table<Compound> {
  static constexpr const char* kName = "compound";
  static constexpr const char* kHelp =
      "Several shapes that form one rigid body, such as a hammer. The mass and the inertia are sums over the "
      "parts; where two parts overlap, the mass of both counts. Round parts are as round for other bodies as "
      "the shapes alone; particles and cloth collide with 32 to 48 flat sides.";
  static Fields<Compound> fields() {
    return {{"parts", &Compound::parts, "shapes of which the body consists; at least one", kRequired}};
  }
};
template <>
struct Tags<Shape> {
  static constexpr const char* kName = "shape";
  static constexpr const char* kHelp =
      "Collision shape of a body. The shape is also drawn, unless the body has a `model`.";
  static constexpr std::array kTags = {"sphere", "box",      "capsule", "cylinder",  "cone",
                                       "plane",  "mesh",     "frustum", "ellipsoid", "torus",
                                       "tube",   "open_box", "compound"};
  static constexpr bool kRequired = true;
};

}  // namespace offstage::producer
