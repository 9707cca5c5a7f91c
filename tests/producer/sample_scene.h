#pragma once
/// A valid scene that uses every section and every kind of value, for the tests of the format.

namespace offstage::producer {

/// The scene. Its model file is LICENSE in the source folder; the tests of the format only check that the
/// file exists.
inline constexpr const char* kSampleScene = R"({
  "$schema": "scene.schema.json",
  "version": 1,
  "description": "everything at once",
  "world": {"gravity": [0, -9.81, 0], "wind": [1, 0, 0], "step": 0.002, "integrator": "midpoint",
            "integration_error": 1e-5, "solver": "fast", "impact": "sequential", "collision_speed": 0.1, "sleep": false,
            "seed": 42},
  "materials": [
    {"name": "red", "color": "#c03020", "roughness": 0.3, "restitution": 1, "friction": 0.2,
     "static_friction": 0.4, "cross_friction": 0.6, "rolling_friction": 0.001, "spinning_friction": 0.002,
     "fabric": {"weave": "twill", "thread": 0.002, "sheen": 0.4, "translucency": 0.1, "back_color": "#ffffff"}},
    {"name": "glass", "color": [0.9, 1, 1, 0.25], "metallic": 0, "pattern": "checker", "pattern_color": "#00000080",
     "texture": "LICENSE", "texture_projection": "triplanar", "texture_scale": 0.5, "texture_angle_deg": 10}
  ],
  "contacts": [{"materials": ["red", "glass"], "restitution": 0.1, "friction": 0, "static_friction": 0.05, "rolling_friction": 0.003, "spinning_friction": 0.004}],
  "bodies": [
    // primitives
    {"name": "floor", "shape": {"type": "plane"}, "motion": "static", "material": "glass"},
    {"name": "ball", "shape": {"type": "sphere", "radius": 0.25}, "position": [0, 2, 0], "mass": 2, "material": "red",
     "friction_axis": [1, 0, 0], "surface_velocity": [0, 0, 1]},
    {"name": "wheel", "shape": {"type": "cylinder", "radius": 1, "height": 0.2}, "motion": "kinematic",
     "orientation": {"axis": [1, 0, 0], "angle_deg": 90}, "spin": [0, 3, 0],
     "keyframes": [{"time": 0}, {"time": 2, "position": [1, 1, 0], "orientation": [1, 0, 0, 1]}], "loop": true},
    {"name": "post", "shape": {"type": "capsule"}, "motion": "static",
     "repeat": {"count": 3, "offset": [2, 0, 0]}, "grid": {"count": [2, 1, 2], "spacing": [5, 1, 5]}},
    {"name": "rock", "shape": {"type": "mesh", "file": "LICENSE"}, "motion": "static",
     "model": {"file": "LICENSE", "scale": 0.5},
     "scatter": {"count": 5, "size": [20, 20], "min_distance": 1, "scale": {"range": [0.5, 1.5]}}}
  ],
  "particles": [
    {"name": "chain", "places": [{"position": [0, 3, 0]}, {"position": [0, 2.5, 0], "color": [1, 0, 0]}], "mass": 0.5}
  ],
  "emitters": [
    {"name": "rain", "surface": {"position": [0, 8, 0], "direction": [0, -1, 0], "size": [4, 4]},
     "rate": {"mean": 200, "deviation": 20}, "speed": {"range": [1, 2]}, "radius": {"mean": 0.01, "deviation": 0.002},
     "lifespan": {"curve": [[0, 1], [2, 1.5]]}, "spread_deg": 5, "dies_on_hit": true,
     "look": {"style": "streak", "color": "#a0c0ff", "color_over_age": [[0, "#ffffff"], [1, [1, 1, 1, 0]]],
              "size_over_age": [[0, 1], [1, 0.5]], "additive": true}},
    {"name": "puff", "body": "ball", "rate": 0, "bursts": [{"time": 1, "count": 30, "cycles": 2}], "gravity": false,
     "surface": {"type": "sphere", "radius": 0.2}, "overlap": true, "windows": [{"start": 0, "end": 2}], "prewarm": 0.5,
     "split": {"count": 2, "age": 0.2, "depth": 2}, "look": {"style": "spark", "temperature_over_age": [[0, 2000], [1, 1200]]},
     "trails": [{"name": "tail", "rate": 30, "look": {"style": "smoke", "ramp": "smooth"}}], "on_age": [{"age": 0.5, "count": 3}],
     "on_collision": [{"name": "splash", "axis": "velocity", "on_death": [{"count": 1}]}]},
    {"name": "hose", "preset": "water_jet", "rate": 10},
    {"name": "ring", "surface": {"type": "disc", "direction": [1, 0, 0]}, "direction": [0, 1, 0], "internal": true, "charge": 1e-9},
    {"name": "shell", "surface": {"type": "mesh", "file": "LICENSE"}, "rate": 5}
  ],
  "effects": [{"preset": "rain", "name": "shower", "position": [9, 0, 0], "start": 1, "overrides": {"rain": {"rate": 50}}}],
  "springs": [
    {"a": {"particles": "chain"}, "b": {"particles": "chain", "index": 1}, "stiffness": 50, "damping": 0.1},
    {"name": "tie", "a": {"position": [0, 4, 0]}, "b": {"body": "ball", "position": [0, 0.25, 0]}, "material": "red"}
  ],
  "cloths": [
    {"name": "curtain", "shape": {"type": "grid", "size": [2, 1], "cells": [8, 4]}, "fabric": "silk", "thickness": 0.01, "max_shear": 1.2,
     "material": "red", "position": [0, 9, 0], "orientation": {"axis": [1, 0, 0], "angle_deg": 90}, "velocity": [1, 0, 0],
     "pins": [{"type": "corners", "corners": ["top_left"]}, {"type": "side", "side": "left", "every": 2, "body": "ball", "until": 1},
              {"type": "nearest", "point": [1, 0, 0]}, {"type": "box", "centre": [1, 0, 0], "size": [0.1, 1, 1]}],
     "seams": [{"type": "sides", "a": "left", "b": "right", "reversed": true}, {"type": "points", "a": [0, 0, 0], "b": [0, 0, 0.5]}],
     "seam_time": 0.5, "tear": 1.5, "air_density": 1, "integrator": "implicit", "substep": 0.001,
     "repeat": {"count": 2, "offset": [0, 0, 3]}},
    {"name": "sack", "shape": {"type": "mesh", "file": "LICENSE", "scale": 2}, "self_collision": false, "casts_shadow": false}
  ],
  "forces": [
    {"type": "constant", "force": [0, 0, 1], "region": {"type": "box", "size": [4, 4, 4]}, "drop_rate": 1},
    {"type": "point", "point": [0, 5, 0], "force": -3, "region": {"type": "sphere", "radius": 2}, "end": 2},
    {"type": "wind", "name": "gust", "wind": [5, 0, 0], "drag": 0.1, "start": 0.5, "bodies": ["ball"]},
    {"type": "grab", "body": "ball", "point": [0, 0.25, 0], "keyframes": [{"position": [0, 3, 0]}], "end": 1},
    {"type": "explosion", "time": 1, "point": [0, 0, 0.1], "impulse": 4, "radius": 3, "drop_rate": 2, "particles": ["rain", "puff/tail"]},
    {"type": "vortex", "particles": ["puff"], "circulation": 2, "drag": 0.001},
    {"type": "turbulence", "particles": ["puff", "puff/splash"], "speed": 2, "scale": 0.5, "octaves": 3, "cloths": ["curtain"]},
    {"type": "gravitation", "particles": ["ring"]}, {"type": "coulomb", "particles": ["ring"], "cut_off": 0.5},
    {"type": "lennard_jones", "particles": ["ring"], "sigma": 0.02, "cut_off": 0.05}
  ],
  "overlays": [
    {"type": "tree", "body": "rock_0", "volume": "sphere", "level": {"curve": [[0, 0], [3, 4]]}, "hidden": 0},
    {"type": "parts", "body": "rock_1", "explode": 0.5},
    {"type": "closest", "a": "ball", "b": "wheel", "color": "#40c0ff", "width": 0.004},
    {"type": "contacts", "margin": 0.02, "force_scale": 0.01},
    {"type": "velocities", "angular_scale": 0.1},
    {"type": "islands", "asleep": 0.1},
    {"type": "cloth", "cloth": "sack", "strain": 0.1}
  ],
  "camera": {"type": "keyframes", "keyframes": [{"time": 0, "eye": [4, 2, 6]}, {"time": 3, "eye": [0, 2, 7]}]},
  "lights": [{"type": "sun", "direction": [1, 2, 1], "color": [1, 0.9, 0.8]}],
  "environment": {"fog": 0.01, "background": "sky", "picture": {"file": "LICENSE", "turn_deg": 30, "blur_deg": 2, "visible": false}},
  "render": {"size": [320, 180], "quality": "draft", "tone_curve": "linear"},
  "output": {"fps": 24, "duration": 3, "start": 0.5}
}
)";

}  // namespace offstage::producer
