#pragma once
/// The keys of an entry of `bodies`, with its model, animation and keyframes. table_shape.h has the keys of
/// its shape, and table_placement.h has the keys of its copies.

#include <array>

#include "producer/format/table_placement.h"
#include "producer/format/table_shape.h"
#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Names<sim::MotionType> {
  static constexpr std::array kNames = {"static", "kinematic", "dynamic"};
};
template <>
struct Table<ModelLook> {
  static constexpr const char* kName = "model";
  static constexpr const char* kHelp = "A model file drawn instead of the body's shape.";
  static Fields<ModelLook> fields() {
    return {{"file", &ModelLook::file, kModelFileHelp, kRequired},
            {"scale", &ModelLook::scale, kModelScaleHelp, "", kScale},
            {"fit", &ModelLook::fit, kModelFitHelp, "m", kPositive},
            {"position", &ModelLook::position, "position of the model's origin in the body's frame", "m"},
            {"orientation", &ModelLook::orientation, "orientation of the model in the body's frame"}};
  }
};
template <>
struct Table<BodyKey> {
  static constexpr const char* kName = "body_key";
  static constexpr const char* kHelp = "A pose of a kinematic body at a time.";
  static Fields<BodyKey> fields() {
    return {{"time", &BodyKey::time, "time of the key; times must increase", "s"},
            {"position", &BodyKey::position,
             "position of the body at this key; default: the body's `position`", "m"},
            {"orientation", &BodyKey::orientation,
             "orientation of the body at this key; default: the body's `orientation`"},
            {"interpolation", &BodyKey::interpolation,
             "interpolation from this key to the next; default: the interpolation of the body"}};
  }
};
template <>
struct Table<ModelAnimation> {
  static constexpr const char* kName = "animation";
  static constexpr const char* kHelp =
      "An animation of a glTF 2.0 file: nodes, skins and morph targets. Only static and kinematic bodies can "
      "have animated shapes. In such a shape, each node with triangles collides as a kinematic body, and so "
      "does each bone, as the convex hull of the skin around it.";
  static Fields<ModelAnimation> fields() {
    using T = ModelAnimation;
    return {
        {"clip", &T::clip, "name of the animation, or its number from 0; empty: the first one"},
        {"speed", &T::speed, "speed of playback: seconds of the animation per second of the film", "",
         kNotNegative},
        {"start", &T::start,
         "time of the film at which the animation starts; until then its first pose is held", "s"},
        {"loop", &T::loop, "whether the animation starts again at its end; false: its last pose is held"}};
  }
};
template <>
struct Table<Body> {
  static constexpr const char* kName = "body";
  static constexpr const char* kHelp = "A rigid body.";
  static Fields<Body> fields() {
    using T = Body;
    return Fields<T>{
        {"name", &T::name,
         "name, unique among bodies and cloths; default: body_N, where N is the index in the list"},
        {"motion", &T::motion,
         "`static` bodies never move, `kinematic` bodies follow their keyframes and spin, `dynamic` bodies "
         "are moved by forces"},
        {"shape", &T::shape, "shape with which the body collides"},
        {"model", &T::model, "model file drawn instead of the shape"},
        {"animation", &T::animation,
         "animation of the model file that is played. If the file is the body's shape, its moving nodes and "
         "bones push other bodies; if it is its `model`, they are only drawn"},
        {"material", &T::material, "name of a material; empty: grey, or the materials of the model file"},
        {"position", &T::position, "position of the body's origin at time 0", "m"},
        {"orientation", &T::orientation, "orientation of the body at time 0"},
        {"velocity", &T::velocity, "velocity of the centre of mass at time 0; dynamic bodies only", "m/s"},
        {"angular_velocity", &T::angular_velocity,
         "angular velocity at time 0, in world axes; dynamic bodies only", "rad/s"},
        {"density", &T::density, "density of the body; determines the mass unless `mass` is given", "kg/m^3",
         kPositive},
        {"mass", &T::mass, "mass of a dynamic body; 0: computed from density and volume", "kg", kNotNegative},
        {"centre", &T::centre, "centre of mass in the body's frame; default: the shape's centre of mass",
         "m"},
        {"inertia", &T::inertia,
         "moments of inertia Ixx, Iyy and Izz about the centre of mass, in the body's axes; default: the "
         "moments of the shape about its own centre, for the body's mass",
         "kg m^2", kPositive},
        {"inertia_products", &T::inertia_products,
         "off-diagonal elements Ixy, Iyz and Izx of the inertia matrix; need `inertia`", "kg m^2"},
        {"linear_drag", &T::linear_drag, "drag force per speed relative to the air; 0: no drag", "kg/s",
         kNotNegative},
        {"angular_drag", &T::angular_drag, "drag torque per angular speed; 0: no drag", "kg m^2/s",
         kNotNegative},
        {"friction_axis", &T::friction_axis,
         "direction in the body's frame along which the material's `friction` applies; across it, "
         "`cross_friction` applies; zero: friction is the same in all directions. If both bodies of a "
         "contact have an axis, the contact uses the axis of the body that is listed first in the scene"},
        {"surface_velocity", &T::surface_velocity,
         "velocity of the surface relative to the body, as on a conveyor belt; in the body's frame. Only its "
         "part along the surface has an effect",
         "m/s"},
        {"collides", &T::collides, "whether the body collides with bodies, particles and cloths"},
        {"visible", &T::visible, "whether the object is drawn"},
        {"casts_shadow", &T::casts_shadow, "whether the object casts a shadow"},
        {"bevel", &T::bevel,
         "radius of the rounded edges with which the body's boxes are drawn; 0: sharp edges, through whose "
         "seams "
         "no light falls. Their collision shape has sharp edges. Default: 0.04 of the smallest edge, at most "
         "0.05 m",
         "m", kNotNegative},
        {"keyframes", &T::keyframes, "poses over time; kinematic bodies only"},
        {"interpolation", &T::interpolation, kInterpolationHelp},
        {"loop", &T::loop, "whether the keyframes repeat; false: the last pose is held"},
        {"appear_at", &T::appear_at,
         "time at which the body appears, at its pose and velocity of time 0; its joints and cloth pins then "
         "connect it to the other bodies and the cloths, where these are at that time",
         "s", kNotNegative},
        {"remove_at", &T::remove_at,
         "time at which the body is removed, with its springs, joints and cloth pins; must be later than "
         "`appear_at`",
         "s", kPositive},
        {"spin", &T::spin, "constant angular velocity in the body's axes; kinematic bodies only", "rad/s"},
    }
        .with(&T::placement);
  }
};

}  // namespace offstage::producer
