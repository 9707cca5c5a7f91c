#!/usr/bin/env python3
"""Makes the gallery's models in models/. Run it by hand: python3 assets/make_models.py [NAME ...]. It needs
nothing but Python 3 and writes the same bytes every time. CREDITS.md lists sizes, axes and pivots."""

import math
import pathlib
import struct
import sys
import zlib

from modelling import (GlbWriter, Material, Mesh, Node, add, circle, cross, cylinder, dot, ellipsoid, extrude, fractal_noise,
                       grid_triangles, hashed, icosphere, lathe, mix, mul, noise, open_edges, ring, rod,
                       rounded, shaded, smoothstep, sub, surface_nets, sweep, turn, union, unit, volume,
                       welded, write_glb, extend_glb, write_glb_tree, write_mtl, write_obj, write_ply)

MODELS = pathlib.Path(__file__).resolve().parent / "models"

STEEL = Material("steel", "#b4b8bd", 0.3, 1)
BRASS = Material("brass", "#d9b25f", 0.28, 1)
RED = Material("red_paint", "#a3261d", 0.35)
GREEN = Material("green_paint", "#1f5a44", 0.35)

# --- duck -----------------------------------------------------------------------------------------


def duck():
    flank = [ellipsoid((side * 0.3, 0.4, -0.06), (0.09, 0.15, 0.27)) for side in (-1, 1)]
    hull = union(0.12, ellipsoid((0, 0.33, 0), (0.36, 0.33, 0.5)),
                 ellipsoid((0, 0.53, -0.46), (0.15, 0.11, 0.15)))
    body = union(0.1, union(0.05, hull, *flank), ellipsoid((0, 0.755, 0.22), (0.245, 0.24, 0.245)))
    beak = union(0.02, ellipsoid((0, 0.725, 0.475), (0.13, 0.034, 0.13)),
                 ellipsoid((0, 0.675, 0.455), (0.1, 0.026, 0.1)),
                 ellipsoid((0, 0.71, 0.42), (0.1, 0.06, 0.06)))
    rubber = surface_nets(body, (-0.5, -0.08, -0.7), (0.5, 1.08, 0.6), 0.02)
    horn = surface_nets(beak, (-0.2, 0.6, 0.3), (0.2, 0.8, 0.65), 0.0105)
    eye = shaded(icosphere(3).mapped(lambda p: mul(p, 0.04)))
    eyes = Mesh().joined(*(eye.moved((side * 0.1, 0.83, 0.415)) for side in (-1, 1)))
    write_glb(MODELS / "duck.glb", [(rubber, Material("rubber", "#f8c81c", 0.25)),
                                    (horn, Material("beak", "#f07a12", 0.3)),
                                    (eyes, Material("eyes", "#0b0b0d", 0.1))])


# --- fountain -------------------------------------------------------------------------------------


def fountain():
    basin = [(0, 0), (1.44, 0), (1.48, 0.02), (1.48, 0.1), (1.42, 0.14), (1.38, 0.2), (1.4, 0.34),
             (1.47, 0.4), (1.5, 0.45), (1.5, 0.5), (1.46, 0.54), (1.34, 0.54), (1.3, 0.5), (1.28, 0.2),
             (1.2, 0.14), (0.45, 0.14)]
    column = [(0.36, 0.18), (0.36, 0.3), (0.28, 0.36), (0.2, 0.46), (0.16, 0.6), (0.15, 0.8), (0.19, 0.88),
              (0.19, 0.93), (0.13, 0.97), (0.13, 1.02)]
    bowl = [(0.3, 1.08), (0.55, 1.16), (0.7, 1.27), (0.76, 1.36), (0.78, 1.42), (0.74, 1.44), (0.7, 1.42),
            (0.64, 1.33), (0.5, 1.25), (0.2, 1.22)]
    finial = [(0.1, 1.26), (0.09, 1.42), (0.12, 1.48), (0.12, 1.51), (0.07, 1.55), (0.08, 1.6), (0.13, 1.67),
              (0.135, 1.74), (0.1, 1.81), (0.045, 1.85), (0.03, 1.88), (0, 1.88)]
    stone = shaded(lathe(rounded(basin + column + bowl + finial, 1), 80), 35)
    water = [
        shaded(lathe([(outer, y), (inner, y)], 80))
        for inner, outer, y in ((0.15, 1.295, 0.44), (0.06, 0.69, 1.38))
    ]
    write_glb(MODELS / "fountain.glb", [(stone, Material("stone", "#b9b1a2", 0.75)),
                                        (Mesh().joined(*water), Material("water", "#4c6b7d", 0.06))])


# --- sprinkler ------------------------------------------------------------------------------------

NOZZLE_TIP = (0.25, 0.1, 0.03)
NOZZLE_DIRECTION = unit((math.cos(math.radians(25)), math.tan(math.radians(36)), math.sin(math.radians(25))))


def sprinkler():
    steel, brass = Material("zinc", "#9aa0a4", 0.35, 1), Material("brass", "#d9b25f", 0.3, 1)
    green = Material("lawn_green", "#2c6e3f", 0.45)
    spike = lathe(rounded([(0, -0.16), (0.012, -0.1), (0.02, 0), (0.02, 0.02), (0, 0.02)], 1), 24)
    foot = lathe([(0, 0), (0.11, 0), (0.12, 0.008), (0.115, 0.02), (0.05, 0.032), (0.026, 0.05), (0.02, 0.09),
                  (0.02, 0.17), (0.028, 0.175), (0.028, 0.19), (0.02, 0.195), (0, 0.195)], 40)
    write_obj(MODELS / "sprinkler_base.obj", [(shaded(spike), steel), (shaded(foot, 30), green)],
              pathlib.Path("sprinkler.mtl"))

    hub = lathe(
        rounded([(0, -0.02), (0.026, -0.02), (0.034, -0.01), (0.034, 0.025), (0.026, 0.04), (0, 0.045)], 1),
        32)
    start = add(NOZZLE_TIP, mul(NOZZLE_DIRECTION, -0.05))
    path = rounded([(0.02, 0.01, 0), (0.12, 0.012, 0), (0.19, 0.02, 0), start], 3)
    arm = sweep(path, [0.011] * len(path), 14)
    nozzle = sweep([start, add(NOZZLE_TIP, mul(NOZZLE_DIRECTION, -0.012)), NOZZLE_TIP], [0.017, 0.016, 0.01],
                   18)
    both = [[shaded(m, 35), shaded(m, 35).turned("y", 180)] for m in (arm, nozzle)]
    write_obj(MODELS / "sprinkler_head.obj", [(shaded(hub, 30), green),
                                              (both[0][0].joined(both[0][1]), steel),
                                              (both[1][0].joined(both[1][1]), brass)],
              pathlib.Path("sprinkler.mtl"))
    write_mtl(MODELS / "sprinkler.mtl", [steel, green, brass])


# --- solids for the physics -----------------------------------------------------------------------


def t_handle():
    shape = union(0.06, rod((-0.4, 0, 0), (0.4, 0, 0), 0.09, 0.035),
                  rod((0, -0.05, 0), (0, -0.52, 0), 0.08, 0.03))
    mesh = surface_nets(shape, (-0.44, -0.56, -0.13), (0.44, 0.13, 0.13), 0.0145)
    assert open_edges(mesh) == 0
    write_glb(MODELS / "t_handle.glb", [(mesh, Material("steel", "#c3c7cc", 0.22, 1))])


def landscape():
    cells, half = 82, 12

    def height(x, z):
        rim = smoothstep(6.5, 12, (x**4 + z**4)**0.25)
        hills = fractal_noise((x / 5, 0, z / 5), 3, seed=5)
        return 0.016 * (x * x + z * z) * (1 - rim) + hills * (0.75 - 0.4 * rim) + 4 * rim

    axis = [mix(-half, half, k / cells) for k in range(cells + 1)]
    top = [(x, height(x, z), z) for z in axis for x in axis]
    lowest = min(p[1] for p in top)
    top = [add(p, (0, -lowest, 0)) for p in top]
    side = cells + 1
    border = [
        *range(cells), *(k * side + cells for k in range(cells)),
        *(side * side - 1 - k for k in range(cells)), *((cells - k) * side for k in range(cells))
    ]
    foot = [(top[v][0], -1, top[v][2]) for v in border]
    triangles, n = grid_triangles(side, side), len(border)
    for k in range(n):
        a, b, c, d = border[k], border[(k + 1) % n], len(top) + k, len(top) + (k + 1) % n
        triangles += [(a, b, d), (a, d, c), (c, d, len(top) + n)]
    mesh = Mesh(top + foot + [(0, -1, 0)], triangles)
    assert open_edges(mesh) == 0
    write_ply(MODELS / "landscape.ply", shaded(mesh, 50))


# --- machine --------------------------------------------------------------------------------------


def gear_outline(teeth, module, phase=0.0):
    """Involute teeth, pressure angle 20 degrees, a little thin for backlash, straight fillets."""
    pitch = teeth * module / 2
    base, tip, root = pitch * math.cos(math.radians(20)), pitch + module, pitch - 1.25 * module

    def involute(radius):
        angle = math.acos(min(base / radius, 1))
        return math.tan(angle) - angle

    def half_thickness(radius):
        at_pitch = math.pi / (2 * teeth) - 0.02 * module / pitch
        below_base = max(base - radius, 0) / pitch
        return at_pitch + involute(pitch) - involute(max(radius, base)) + 0.25 * below_base

    start = max(base, root)
    radii = [root] + [mix(start, tip, (k / 6)**1.5) for k in range(7)]
    flank = [(half_thickness(r), r) for r in radii]
    tooth = [(-a, r) for a, r in flank] + [(a, r) for a, r in reversed(flank)]
    return [(2 * math.pi * k / teeth + phase + a, r) for k in range(teeth) for a, r in tooth]


def spokes(count, inner, outer, width, half_depth):
    outline = [(inner, -width * 0.62), (outer, -width * 0.45), (outer, width * 0.45), (inner, width * 0.62)]
    one = shaded(extrude(outline, -half_depth, half_depth, 0.015), 30)
    return Mesh().joined(*(one.turned("z", 360 * k / count) for k in range(count)))


def gears():
    teeth = shaded(welded(ring(gear_outline(24, 0.1), 0.9, 0.1, 0.012)), 25)
    hub = shaded(ring(circle(0.3), 0.12, 0.14, 0.02), 30)
    write_glb(MODELS / "gear_large.glb", [(teeth, STEEL),
                                          (hub.joined(spokes(5, 0.25, 0.95, 0.22, 0.06)), RED)])

    teeth = shaded(welded(ring(gear_outline(12, 0.1, math.pi / 12), 0.4, 0.1, 0.012)), 25)
    web = shaded(ring(circle(0.41), 0.2, 0.06, 0.01), 30)
    hub = shaded(ring(circle(0.22), 0.12, 0.14, 0.02), 30)
    write_glb(MODELS / "gear_small.glb", [(teeth.joined(web, hub), BRASS)])


def link(r0, r1, distance, segments=24):
    """Outline of two discs, at (0, 0) and (0, distance), with their common tangents."""
    tilt = math.asin((r0 - r1) / distance)
    arcs = [(r1, distance, tilt, math.pi - tilt), (r0, 0, math.pi - tilt, 2 * math.pi + tilt)]
    return [(r * math.cos(mix(a, b, k / segments)), y + r * math.sin(mix(a, b, k / segments)))
            for r, y, a, b in arcs for k in range(segments + 1)]


def crank():
    web = shaded(extrude(link(0.28, 0.2, 0.5), -0.08, 0.08, 0.02), 30)
    pins = Mesh().joined(shaded(cylinder(0.12, -0.5, 0.14, 0.015), 30),
                         shaded(cylinder(0.1, 0, 0.34, 0.015), 30).moved((0, 0.5, 0)))
    write_glb(MODELS / "crank.glb", [(web, RED), (pins, STEEL)])


def connecting_rod():

    def bar(x, low, high, half_depth, chamfer):
        """Tapered between the eyes: half widths `low` and `high`, the middle line from x to 0.75 x."""
        outline = [(x - low, 0.19), (x + low, 0.19), (0.75 * x + high, 1.86), (0.75 * x - high, 1.86)]
        return shaded(extrude(outline, -half_depth, half_depth, chamfer), 30)

    big, small = ring(circle(0.22), 0.125, 0.09, 0.015), ring(circle(0.17), 0.095, 0.08, 0.015)
    beam = [bar(-0.085, 0.025, 0.02, 0.06, 0.008), bar(0.085, 0.025, 0.02, 0.06, 0.008),
            bar(0, 0.09, 0.07, 0.022, 0.005)]
    steel = shaded(big, 30).joined(shaded(small, 30).moved((0, 2, 0)), *beam)
    big, small = ring(circle(0.127), 0.1, 0.1, 0.006), ring(circle(0.097), 0.075, 0.09, 0.006)
    bushes = shaded(big, 30).joined(shaded(small, 30).moved((0, 2, 0)))
    write_glb(MODELS / "rod.glb", [(steel, STEEL), (bushes, BRASS)])


def piston():
    wall = [(0, 0.4), (0.36, 0.37), (0.43, 0.36), (0.45, 0.34)]
    for y in (0.3, 0.22, 0.14):
        wall += [(0.45, y), (0.425, y), (0.425, y - 0.035), (0.45, y - 0.035)]
    wall += [(0.45, -0.38), (0.44, -0.4), (0.36, -0.4), (0.36, 0.14), (0.3, 0.2), (0, 0.2)]
    crown = shaded(lathe(wall[::-1], 72), 30)
    pin = shaded(cylinder(0.075, -0.4, 0.4, 0.01), 30)
    write_glb(MODELS / "piston.glb", [(crown, Material("aluminium", "#c9ccd0", 0.35, 1)), (pin, STEEL)])


def flywheel():
    rim = shaded(ring(circle(1.5, 144), 1.24, 0.15, 0.025), 30)
    hub = shaded(ring(circle(0.3), 0.12, 0.2, 0.025), 30)
    band = shaded(ring(circle(1.506, 144), 1.45, 0.1, 0.004), 30)
    write_glb(MODELS / "flywheel.glb", [(rim.joined(hub, spokes(6, 0.24, 1.3, 0.2, 0.06)), GREEN),
                                        (band, STEEL)])


# --- a robot arm ----------------------------------------------------------------------------------


def robot_arm():
    """Links as nodes, each about the axis that it turns on: the base's is y, the arms' z; fingers slide along x."""
    orange, grey = Material("orange", "#e8742c", 0.4), Material("graphite", "#3a3f45", 0.5, 0.4)

    def upright(radius, y0, y1, chamfer=0.01):
        return shaded(cylinder(radius, y0, y1, chamfer), 30).turned("x", -90)

    def box(low, high, chamfer=0.008):
        outline = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        return shaded(extrude(outline, low[2], high[2], chamfer), 30)

    def arm(r0, r1, distance, z0, z1):
        return shaded(extrude(link(r0, r1, distance), z0, z1, 0.012), 30)

    def pin(radius, half, y=0):
        return shaded(cylinder(radius, -half, half, 0.006), 30).moved((0, y, 0))

    base = [(upright(0.36, 0, 0.06, 0.02).joined(upright(0.27, 0.05, 0.2, 0.02)), grey)]
    cheek = shaded(extrude([(-0.2, 0.1), (0.2, 0.1), (0.13, 0.45), (-0.13, 0.45)], 0.125, 0.185, 0.01), 30)
    turret = [(upright(0.25, 0.005, 0.12, 0.015).joined(cheek, cheek.moved((0, 0, -0.31))), orange),
              (pin(0.08, 0.2, 0.35), grey)]
    upper = [(arm(0.12, 0.1, 0.8, -0.11, 0.11), orange), (pin(0.05, 0.18, 0.8), grey)]
    fork = arm(0.1, 0.07, 0.62, 0.12, 0.17)
    fore = [(fork.joined(fork.moved((0, 0, -0.29)), box((-0.055, 0.2, -0.125), (0.055, 0.5, 0.125))), orange),
            (pin(0.04, 0.185, 0.62), grey)]
    hand = [(arm(0.07, 0.06, 0.1, -0.11, 0.11).joined(box((-0.2, 0.1, -0.07), (0.2, 0.16, 0.07))), grey)]
    finger = [(box((-0.02, 0, -0.06), (0.02, 0.17, 0.06)), orange)]
    left = Node("finger_left", finger, (-0.16, 0.165, 0))
    right = Node("finger_right", finger, (0.16, 0.165, 0))
    tree = Node("base", base, (0, 0, 0), [
        Node("turret", turret, (0, 0.2, 0), [
            Node("upper_arm", upper, (0, 0.35, 0), [
                Node("forearm", fore, (0, 0.8, 0), [Node("hand", hand, (0, 0.62, 0), [left, right])])
            ])
        ])
    ])
    write_glb_tree(MODELS / "robot_arm.glb", tree)


# --- stone, tracks and tops -----------------------------------------------------------------------


def voussoir():
    """A wedge of a half round arch of 11, chamfered; the flat sides of its back and belly are across Y."""
    half, inner, outer = math.pi / 22, 1.2, 1.62
    flat = math.cos(half)
    outline = [(-outer * flat * math.tan(half), outer * flat), (-inner * flat * math.tan(half), inner * flat),
               (inner * flat * math.tan(half), inner * flat), (outer * flat * math.tan(half), outer * flat)]
    stone = shaded(extrude(outline, -0.3, 0.3, 0.012), 20)
    assert open_edges(stone) == 0
    write_glb(MODELS / "voussoir.glb", [(stone, Material("limestone", "#c9bfa8", 0.9))])


def top():
    """A peg top that ends in a point."""
    profile = [(0, 0), (0.0022, 0.004), (0.003, 0.012), (0.012, 0.018), (0.026, 0.027), (0.03, 0.033),
               (0.03, 0.037), (0.026, 0.041), (0.008, 0.046), (0.0035, 0.05), (0.003, 0.068), (0.002, 0.07),
               (0, 0.07)]
    bands = [("steel", profile[:3]), ("red", profile[2:6]), ("cream", profile[5:8]), ("red", profile[7:10]),
             ("steel", profile[9:])]
    paint = {"steel": STEEL, "red": Material("lacquer", "#b02a1c", 0.25),
             "cream": Material("cream", "#ead9ae", 0.3)}
    assert open_edges(lathe(profile, 40)) == 0
    write_glb(MODELS / "top.glb", [(shaded(lathe(part, 40), 30), paint[name]) for name, part in bands])


def gutter(path, radius, wall, segments=10):
    """A half pipe, open upwards, along a path of the points of its bottom line; a closed solid."""
    angles = [math.pi * (k / segments - 0.5) for k in range(segments + 1)]
    section = [(radius * math.sin(a), radius - radius * math.cos(a)) for a in angles]
    section += [((radius + wall) * math.sin(a), radius - (radius + wall) * math.cos(a)) for a in angles[::-1]]
    rows = []
    for k, p in enumerate(path):
        ahead = sub(path[min(k + 1, len(path) - 1)], path[max(k - 1, 0)])
        side = unit(cross(ahead, (0, 1, 0)))
        up = unit(cross(side, ahead))
        rows += [add(p, add(mul(side, x), mul(up, y))) for x, y in section]
    n = len(section)
    triangles = grid_triangles(len(path), n, wrap_columns=True)
    last = (len(path) - 1) * n
    for k in range(segments):
        a, b, c, d = k, k + 1, n - 1 - k, n - 2 - k
        triangles += [(a, b, c), (b, d, c), (last + a, last + c, last + b), (last + b, last + c, last + d)]
    return oriented(Mesh(rows, triangles))


def oriented(mesh):
    """A closed mesh turned the right side out."""
    return mesh if volume(mesh) > 0 else Mesh(mesh.positions, [(a, c, b) for a, b, c in mesh.triangles])


def marble_run():
    beech = Material("beech", "#c99a5f", 0.5)
    red, blue = Material("red_stain", "#a8322a", 0.45), Material("blue_stain", "#2c5a86", 0.45)

    def save(name, mesh, material):
        assert open_edges(mesh) == 0 and volume(mesh) > 0
        write_glb(MODELS / name, [(shaded(mesh, 30), material)])

    bowl = [(0.0185, 0), (0.023, 0.016), (0.036, 0.026), (0.07, 0.036), (0.11, 0.052), (0.13, 0.072)]
    bowl = rounded(bowl, 2)
    wall = bowl + [(r + 0.004, y - 0.006) for r, y in bowl[::-1]]
    save("funnel.glb", oriented(lathe([*wall, wall[0]], 64)), beech)
    turns, radius, fall = 2, 0.1, 0.12
    helix = [(radius * math.cos(a), -fall * k / 96, radius * math.sin(a))
             for k, a in ((k, 2 * math.pi * turns * k / 96) for k in range(97))]
    save("helix.glb", gutter(helix, 0.02, 0.004), blue)
    save("chute.glb", gutter([(0, 0, 0), (0.3, 0, 0)], 0.02, 0.004), red)


# --- cloth and what lies on it --------------------------------------------------------------------


def dishes():
    china = Material("china", "#e9e6de", 0.22)

    def save(name, profile, material):
        mesh = oriented(lathe(rounded(profile, 2), 64))
        assert open_edges(mesh) == 0
        write_glb(MODELS / name, [(shaded(mesh, 50), material)])

    save("plate.glb", [(0, 0), (0.07, 0), (0.075, 0.004), (0.1, 0.012), (0.13, 0.019), (0.132, 0.022),
                       (0.128, 0.023), (0.1, 0.017), (0.075, 0.009), (0, 0.008)], china)
    save("bowl.glb", [(0, 0), (0.035, 0), (0.037, 0.006), (0.06, 0.022), (0.078, 0.05), (0.084, 0.075),
                      (0.081, 0.077), (0.074, 0.05), (0.056, 0.026), (0.03, 0.012), (0, 0.01)],
         Material("glaze", "#3f6f8c", 0.2))
    save("goblet.glb", [(0, 0), (0.038, 0), (0.038, 0.004), (0.012, 0.01), (0.006, 0.022), (0.006, 0.07),
                        (0.012, 0.08), (0.032, 0.1), (0.038, 0.13), (0.036, 0.165), (0.034, 0.165),
                        (0.034, 0.13), (0.028, 0.104), (0, 0.09)], Material("silver", "#d6d4ce", 0.2, 1))


def parachute():
    """A flat round canopy with a vent, folded in pleats from its top down, and twelve ribbons from its rim: one open
    sheet. Every other radial line lies farther outwards. The angle between
    neighbouring lines is that of the flat sheet, so that nothing is strained. The texture coordinate u runs back and forth over each
    pair of gores, so that stripes of half their width colour every other gore."""
    sectors, rings, lines, steps = 48, 18, 12, 16
    radius, vent, length, width = 1.7, 0.12, 3.2, 0.03
    step = 2 * math.pi / sectors
    inner = 0.32
    # cos(inner) cos(outer) + sin(inner) sin(outer) cos(step) = cos(step), solved for outer.
    size = math.hypot(math.cos(inner), math.sin(inner) * math.cos(step))
    outer = math.atan2(math.sin(inner) * math.cos(step), math.cos(inner)) + math.acos(math.cos(step) / size)

    def ray(k, r):
        away, a = (outer if k % 2 else inner), step * k
        return (r * math.sin(away) * math.sin(a), -r * math.cos(away), r * math.sin(away) * math.cos(a))

    radii = [mix(vent, radius, j / (rings - 1)) for j in range(rings)]
    positions = [ray(k, r) for r in radii for k in range(sectors)]
    triangles = []
    for j in range(rings - 1):
        for k in range(sectors):
            a, b = j * sectors + k, j * sectors + (k + 1) % sectors
            c, d = a + sectors, b + sectors
            triangles += [(a, c, b), (b, c, d)] if (j + k) % 2 else [(a, c, d), (a, d, b)]
    rim = (rings - 1) * sectors
    for line in range(lines):
        k = line * sectors // lines + 1  # an outer fold
        top, a = positions[rim + k], step * k
        side = (width / 2 * math.cos(a), 0, -width / 2 * math.sin(a))
        foot = (0.14 * math.sin(a), -radius - length, 0.14 * math.cos(a))
        last = (rim + k, rim + k)
        for n in range(1, steps + 1):
            middle = mix_points(top, foot, n / steps)
            row = len(positions)
            positions += [sub(middle, side), add(middle, side)]
            triangles += [(last[0], row, row + 1)] if n == 1 else [(last[0], row, last[1]), (last[1], row, row + 1)]
            last = (row, row + 1)
    mesh = shaded(Mesh(positions, triangles), 180)

    def uv(p):
        away = math.hypot(*p)
        if away > 1.001 * radius:  # a ribbon
            return (0.3, away)
        turns = lines / 2 * (math.atan2(p[0], p[2]) + step) / (2 * math.pi) % 1
        return (0.02 + 0.36 * abs(2 * turns - 1), away)

    mesh.uvs = [uv(p) for p in mesh.positions]
    write_glb(MODELS / "parachute.glb", [(mesh, Material("canopy", "#c8502a", 0.7))])


def mix_points(a, b, t):
    return tuple(mix(x, y, t) for x, y in zip(a, b))


def hammock():
    """A sagging sheet, narrower at its ends, hung along X."""
    columns, rows = 48, 22
    positions = []
    for i in range(columns + 1):
        x = 2 * i / columns - 1
        half = mix(0.3, 0.58, (1 - x * x)**0.7)
        for j in range(rows + 1):
            z = 2 * j / rows - 1
            positions.append((1.1 * x, 0.42 * (x * x - 1) + 0.16 * z * z * (1 - x * x), half * z))
    triangles = []
    for i in range(columns):
        for j in range(rows):
            a, c = i * (rows + 1) + j, (i + 1) * (rows + 1) + j
            b, d = a + 1, c + 1
            triangles += [(a, b, c), (b, d, c)] if (i + j) % 2 else [(a, b, d), (a, d, c)]
    write_glb(MODELS / "hammock.glb", [(shaded(Mesh(positions, triangles), 180), Material("canvas", "#d8c9a8", 0.9))])


def swatch():
    """A flat round sample of cloth for the drape test, 30 cm wide: rings of nearly equilateral triangles."""
    radius, rings = 0.15, 14
    positions = [(0, 0, 0)]
    for r in range(1, rings + 1):
        for k in range(6 * r):
            angle = math.pi * k / (3 * r)
            positions.append((radius * r / rings * math.cos(angle), 0, -radius * r / rings * math.sin(angle)))

    def vertex(r, k):
        return 1 + 3 * r * (r - 1) + k % (6 * r) if r > 0 else 0

    triangles = []
    for r in range(1, rings + 1):
        for side in range(6):
            for k in range(r):
                outer, inner = side * r + k, side * (r - 1) + k
                triangles.append((vertex(r - 1, inner), vertex(r, outer), vertex(r, outer + 1)))
                if k + 1 < r:
                    triangles.append((vertex(r - 1, inner), vertex(r, outer + 1), vertex(r - 1, inner + 1)))
    mesh = shaded(Mesh(positions, triangles), 180)
    mesh.uvs = [(p[0], p[2]) for p in mesh.positions]
    write_glb(MODELS / "swatch.glb", [(mesh, Material("cloth", "#d8d2c4", 0.9))])


# --- set dressing ---------------------------------------------------------------------------------


def blade(k):
    """A bent, tapered leaf of three triangles. Its foot lies on a jittered grid that wraps: patches tile."""
    row, column = divmod(k, 19)
    x, z = ((i + 0.1 + 1.3 * hashed(k, j)) / 19 - 0.5 for i, j in ((column, 0), (row, 1)))
    height, lean = mix(0.1, 0.26, hashed(k, 2)**1.4), mix(0.15, 0.7, hashed(k, 3))
    width, heading = mix(0.006, 0.011, hashed(k, 4)), 360 * hashed(k, 5)
    rows = [(-width, 0, 0), (width, 0, 0), (-0.7 * width, 0.55 * height, 0.25 * lean * height),
            (0.7 * width, 0.55 * height, 0.25 * lean * height), (0, 0.97 * height, 0.9 * lean * height)]
    rotate = turn("y", heading)
    # Rounded across; not turned to the sky, as a two-sided material flips them for the back.
    normals = [rotate(unit((side * 0.5, 0.3, -1))) for side in (-1, 1, -1, 1, 0)]
    return Mesh([add(rotate(p), (x, 0, z)) for p in rows], [(0, 3, 1), (0, 2, 3), (2, 4, 3)], normals)


def grass_patch():
    greens = ["#4f8029", "#649835", "#86a445"]
    groups = [Mesh(), Mesh(), Mesh()]
    for k in range(19 * 19):
        group = 0 if hashed(k, 6) < 0.45 else 1 if hashed(k, 6) < 0.85 else 2
        groups[group] = groups[group].joined(blade(k))
    write_glb(
        MODELS / "grass_patch.glb",
        [(mesh, Material(f"grass_{i}", greens[i], 0.7, two_sided=True)) for i, mesh in enumerate(groups)])


def rock():
    faces = [
        unit(n) for n in ((0.8, 0.6, 0.1), (-0.5, 0.5, 0.7), (-0.3, 0.4, -0.9), (0.5, -0.2, 0.9), (0, -1, 0))
    ]

    def shape(p):
        r = 1 + 0.2 * noise(mul(p, 1.3), 3) + 0.07 * noise(mul(p, 3.1), 4)
        r = min([r, *(0.76 / dot(p, n) for n in faces if dot(p, n) > 0.1)])  # broken along planes
        r += 0.02 * noise(mul(p, 7), 6)
        return (0.62 * r * p[0], 0.46 * r * p[1], 0.52 * r * p[2])

    mesh = icosphere(3).mapped(shape)
    foot = min(p[1] for p in mesh.positions)
    stone = shaded(mesh.moved((0, -foot, 0)), 32)
    write_glb(MODELS / "rock.glb", [(stone, Material("rock", "#857f76", 0.9))])


def leaf(height, reach, width, heading):
    """An arching strip, pointed at both ends."""
    steps, rows = 6, []
    for k in range(steps + 1):
        t = k / steps
        middle = (0, height * math.sin(2.1 * t), reach * t * t)
        w = width * math.sin(math.pi * (0.06 + 0.94 * t)**0.8)
        rows += [(-w, middle[1] + 0.25 * w, middle[2]), (0, middle[1], middle[2]),
                 (w, middle[1] + 0.25 * w, middle[2])]
    triangles = [(a, c, b) for a, b, c in grid_triangles(steps + 1, 3)]
    return shaded(Mesh(rows, triangles), 60).turned("y", heading)


def pot():
    profile = [(0, 0), (0.1, 0), (0.11, 0.01), (0.15, 0.22), (0.165, 0.222), (0.17, 0.23), (0.172, 0.275),
               (0.166, 0.282), (0.15, 0.28), (0.146, 0.25), (0, 0.25)]
    soil = lathe([(0.148, 0.252), (0.08, 0.262), (0, 0.266)], 32)
    leaves = [
        leaf(mix(0.12, 0.3, hashed(k, 0)), mix(0.12, 0.3, hashed(k, 1)), mix(0.025, 0.04, hashed(k, 2)),
             137.5 * k).moved((0, 0.26, 0)) for k in range(16)
    ]
    stems, petals, hearts = [], [], []
    for k in range(3):
        top = (0.1 * math.cos(2.2 * k + 0.4), 0.55 + 0.05 * (k % 2), 0.1 * math.sin(2.2 * k + 0.4))
        path = rounded([(0, 0.26, 0), (0, 0.45, 0), top], 2)
        stems.append(shaded(sweep(path, [0.005] * len(path), 6), 60))
        petal = shaded(icosphere(1).mapped(lambda p: (0.022 * p[0], 0.009 * p[1], 0.036 * p[2] + 0.036)), 70)
        petals += [petal.turned("x", -15).turned("y", 72 * i + 20 * k).moved(top) for i in range(5)]
        hearts.append(shaded(icosphere(1).mapped(lambda p: mul(p, 0.017)), 70).moved(add(top, (0, 0.006, 0))))
    write_glb(MODELS / "pot.glb",
              [(shaded(lathe(profile, 40), 30), Material("terracotta", "#b5603a", 0.8)),
               (shaded(soil, 40), Material("soil", "#3a281c", 0.95)),
               (Mesh().joined(*leaves, *stems), Material("leaves", "#3f7d34", 0.5, two_sided=True)),
               (Mesh().joined(*petals), Material("petals", "#e05a8a", 0.5)),
               (Mesh().joined(*hearts), Material("hearts", "#f2c230", 0.6))])


def tree():
    trunk = rounded([(0, -0.05, 0), (0.05, 0.7, 0.02), (-0.04, 1.4, 0), (0.02, 2.3, 0.05)], 2)
    taper = [mix(0.2, 0.06, (k / (len(trunk) - 1))**0.7) for k in range(len(trunk))]
    bark = [shaded(sweep(trunk, taper, 14), 60)]
    crowns = [(0.0, 2.65, 0.0, 0.85), (0.68, 2.2, 0.15, 0.58), (-0.62, 2.3, 0.3, 0.6),
              (0.1, 2.15, -0.68, 0.55), (-0.25, 3.15, -0.15, 0.55), (0.25, 2.15, 0.6, 0.5)]
    groups = [Mesh(), Mesh()]
    for k, (x, y, z, r) in enumerate(crowns):
        if k > 0:
            branch = [(0, 1.25 + 0.1 * k, 0), (0.5 * x, 0.5 * (y + 1.4), 0.5 * z), (x, y, z)]
            bark.append(shaded(sweep(branch, [0.07, 0.05, 0.03], 8), 60))
        blob = icosphere(2).mapped(lambda p: mul(p, r * (1 + 0.2 * noise(mul(p, 2.2), 20 + k))))
        blob = blob.moved((x, y, z))
        groups[k % 2] = groups[k % 2].joined(shaded(blob, 75))
    write_glb(MODELS / "tree.glb", [(Mesh().joined(*bark), Material("bark", "#6b4a30", 0.9)),
                                    (groups[0], Material("foliage_dark", "#4d8a34", 0.8)),
                                    (groups[1], Material("foliage_light", "#6fa63f", 0.8))])


# --- tentacle -------------------------------------------------------------------------------------


def spotted_png(width, height):
    """A palette PNG: lighter below, with a row of suckers along the middle and dark spots."""
    palette = [(96, 42, 92), (152, 74, 128), (232, 176, 190), (58, 24, 64)]

    def entry(x, y):
        u, v = (x + 0.5) / width, (y + 0.5) / height
        if abs(u - 0.5) < 0.17:
            return 2 if abs(u - 0.5) < 0.1 and (v * 12) % 1 < 0.6 else 1
        return 3 if hashed(7, x // 3, y // 3) > 0.82 else 0

    rows = b"".join(b"\0" + bytes(entry(x, y) for x in range(width)) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    colors = b"".join(bytes(color) for color in palette)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)) +
            chunk(b"PLTE", colors) + chunk(b"IDAT", zlib.compress(rows, 0)) + chunk(b"IEND", b""))


def tentacle():
    """A skinned arm of six bones that sweeps in a loop of 4 s, on a foot whose ring turns."""
    bones, segment, around, per_bone, period, keys = 6, 0.3, 12, 3, 4.0, 17
    rings = bones * per_bone
    mesh = Mesh()
    joints, weights = [], []
    for i in range(rings + 1):
        height = i * segment / per_bone
        radius = 0.17 * (1 - i / rings)**0.8 + 0.015 if i < rings else 0.0
        at = i / per_bone - 0.5
        low = min(max(math.floor(at), 0), bones - 1)
        share = min(max(at - math.floor(at), 0), 1) if 0 <= at < bones - 1 else 0
        for k in range(around + 1):
            angle = 2 * math.pi * k / around
            outward = (math.sin(angle), 0.12, math.cos(angle))
            mesh.positions.append((radius * outward[0], height, radius * outward[2]))
            mesh.normals.append(unit(outward))
            mesh.uvs.append((k / around, 1 - i / rings))
            weight = round(255 * share)
            joints.append((low, min(low + 1, bones - 1), 0, 0))
            weights.append((255 - weight, weight, 0, 0))
    width = around + 1
    for i in range(rings):
        for k in range(around):
            a, b = i * width + k, (i + 1) * width + k
            mesh.triangles.append((a, a + 1, b + 1))
            if i < rings - 1:
                mesh.triangles.append((a, b + 1, b))
    foot = shaded(lathe([(0, 0), (0.34, 0), (0.34, 0.05), (0.24, 0.12), (0, 0.12)], 24))
    cleat = shaded(Mesh([(0.36 * x, 0.02 + 0.07 * y, 0.05 * z) for x in (0.9, 1.25) for y in (0, 1) for z in (-1, 1)],
                        [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6),
                         (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]))
    cleats = Mesh().joined(*(cleat.turned("y", 60 * k) for k in range(6)))
    glb = GlbWriter()
    skin_mesh = glb.mesh([glb.primitive(mesh, glb.material(Material("skin", "#ffffff", 0.45), spotted_png(24, 48)),
                                        JOINTS_0=(joints, "4B"), WEIGHTS_0=(weights, "4B"))])
    metal = glb.material(STEEL)
    nodes = [{"name": "foot", "mesh": glb.mesh([glb.primitive(foot, metal)]), "children": [1, 2]},
             {"name": "ring", "mesh": glb.mesh([glb.primitive(cleats, metal)])}]
    for b in range(bones):
        nodes.append({"name": f"bone_{b}", "translation": [0, 0.1 if b == 0 else segment, 0],
                      **({"children": [3 + b]} if b < bones - 1 else {})})
    nodes.append({"name": "arm", "mesh": skin_mesh, "skin": 0})
    unbind = [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -segment * b, 0, 1] for b in range(bones)]
    times = [period * k / (keys - 1) for k in range(keys)]
    tracks = []
    for b in range(bones):
        turns = []
        for t in times:
            phase = 2 * math.pi * t / period - 0.55 * b
            x, z = 0.28 * math.sin(phase), 0.34 * math.cos(phase)
            angle = math.hypot(x, z)
            s = math.sin(angle / 2) / (angle or 1)
            turns.append((x * s, 0, z * s, math.cos(angle / 2)))
        tracks.append((2 + b, "rotation", turns))
    ring_turns = [(0, math.sin(math.pi * k / (keys - 1)), 0, math.cos(math.pi * k / (keys - 1))) for k in range(keys)]
    tracks.append((1, "rotation", ring_turns))
    glb.write(MODELS / "tentacle.glb", nodes, [0, 2 + bones], joints=range(2, 2 + bones), unbind=unbind,
              clip="sweep", times=times, tracks=tracks)


def lantern():
    """A lantern with the light of its flame, and a camera that looks past it."""
    base = shaded(lathe([(0, 0), (0.09, 0), (0.09, 0.02), (0.03, 0.04), (0, 0.04)], 24))
    cap = shaded(lathe([(0.02, 0.22), (0.09, 0.22), (0.02, 0.27), (0, 0.27), (0, 0.22)], 24))
    post = shaded(lathe([(0, 0.03), (0.008, 0.03), (0.008, 0.23), (0, 0.23)], 8))
    posts = Mesh().joined(*(post.moved((0.075, 0, 0)).turned("y", 90 * k) for k in range(4)))
    path = MODELS / "lantern.glb"
    write_glb(path, [(base.joined(cap, posts), STEEL)])
    extend_glb(path,
               {"node": {"name": "eye", "translation": [0.6, 0.45, 1.9], "rotation": [-0.0436, 0.1305, 0.0057, 0.9905]},
                "value": {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.01}}},
               {"node": {"name": "flame", "translation": [0, 0.12, 0]},
                "value": {"type": "point", "color": [1, 0.72, 0.4], "intensity": 3}})


ALL = [
    duck, fountain, sprinkler, t_handle, landscape, gears, crank, connecting_rod, piston, flywheel, robot_arm,
    voussoir, top, marble_run, dishes, parachute,
    hammock, swatch, grass_patch, rock, pot, tree,
    tentacle, lantern
]

if __name__ == "__main__":
    MODELS.mkdir(exist_ok=True)
    for make in ALL:
        if len(sys.argv) == 1 or make.__name__ in sys.argv[1:]:
            make()
