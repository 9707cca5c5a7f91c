"""A small modelling kit in plain Python: meshes, lathe, sweep, rings, signed distance functions, surface
nets, noise, and writers of GLB, OBJ and PLY. Y is up, faces are counter-clockwise seen from outside, units
are metres."""

import json
import math
import struct
from dataclasses import dataclass, field

# --- vectors --------------------------------------------------------------------------------------


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def mul(a, s):
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a):
    return math.sqrt(dot(a, a))


def unit(a):
    return mul(a, 1 / (length(a) or 1))


def mix(a, b, t):
    return a + (b - a) * t


def smoothstep(a, b, x):
    t = min(max((x - a) / (b - a), 0), 1)
    return t * t * (3 - 2 * t)


def turn(axis, degrees):
    """Rotation about a coordinate axis, as a function of a point."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return {
        "x": lambda p: (p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]),
        "y": lambda p: (c * p[0] + s * p[2], p[1], c * p[2] - s * p[0]),
        "z": lambda p: (c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]),
    }[axis]


# --- repeatable noise -----------------------------------------------------------------------------


def hashed(*keys):
    """A number in [0, 1) that depends on the integer keys alone (an integer mixer, the same everywhere)."""
    h = 0x9E3779B97F4A7C15
    for key in keys:
        h = ((h ^ (key & 0xFFFFFFFFFFFFFFFF)) * 0xBF58476D1CE4E5B9) & 0xFFFFFFFFFFFFFFFF
        h ^= h >> 29
        h = (h * 0x94D049BB133111EB) & 0xFFFFFFFFFFFFFFFF
        h ^= h >> 32
    return (h >> 11) / (1 << 53)


def noise(p, seed=0):
    """Smooth value noise in [-1, 1] with features one metre wide."""
    base = [math.floor(c) for c in p]
    w = [(c - b)**3 * ((c - b) * ((c - b) * 6 - 15) + 10) for c, b in zip(p, base)]
    total = 0
    for corner in range(8):
        bits = [corner >> k & 1 for k in range(3)]
        weight = math.prod(w[k] if bits[k] else 1 - w[k] for k in range(3))
        total += weight * hashed(seed, *(base[k] + bits[k] for k in range(3)))
    return 2 * total - 1


def fractal_noise(p, octaves, seed=0):
    return sum(noise(mul(p, 2**k), seed + k) / 2**k for k in range(octaves))


# --- meshes ---------------------------------------------------------------------------------------


@dataclass
class Mesh:
    positions: list = field(default_factory=list)
    triangles: list = field(default_factory=list)
    normals: list = field(default_factory=list)  # empty, or one per position
    uvs: list = field(default_factory=list)  # the same; where it matters, given last

    def moved(self, offset):
        return self.mapped(lambda p: add(p, offset))

    def turned(self, axis, degrees):
        rotation = turn(axis, degrees)
        return Mesh([rotation(p) for p in self.positions], self.triangles,
                    [rotation(n) for n in self.normals])

    def mapped(self, function):
        """Positions through a function that changes shapes little enough for the normals to stay."""
        return Mesh([function(p) for p in self.positions], self.triangles, self.normals)

    def joined(self, *others):
        result = Mesh(list(self.positions), list(self.triangles), list(self.normals))
        for other in others:
            first = len(result.positions)
            result.positions += other.positions
            result.normals += other.normals
            result.triangles += [tuple(first + i for i in t) for t in other.triangles]
        return result


def welded(mesh):
    """Vertices at one place become one; triangles that collapse go."""
    index, positions = {}, []
    for p in mesh.positions:
        key = tuple(round(c * 1e7) for c in p)
        if key not in index:
            index[key] = len(positions)
            positions.append(p)
    new = [index[tuple(round(c * 1e7) for c in p)] for p in mesh.positions]
    triangles = [tuple(new[i] for i in t) for t in mesh.triangles]
    return Mesh(positions, [t for t in triangles if len(set(t)) == 3])


def shaded(mesh, crease=40):
    """Adds normals: area-weighted means over the faces around a vertex that are within `crease` degrees."""
    mesh = welded(mesh)
    scaled = [
        cross(sub(mesh.positions[b], mesh.positions[a]), sub(mesh.positions[c], mesh.positions[a]))
        for a, b, c in mesh.triangles
    ]
    units = [unit(n) for n in scaled]
    around = [[] for _ in mesh.positions]
    for f, triangle in enumerate(mesh.triangles):
        for v in triangle:
            around[v].append(f)
    limit = math.cos(math.radians(crease))
    result, index = Mesh(), {}
    for f, triangle in enumerate(mesh.triangles):
        corners = []
        for v in triangle:
            total = (0, 0, 0)
            for g in around[v]:
                if dot(units[f], units[g]) >= limit:
                    total = add(total, scaled[g])
            normal = unit(total)
            key = (v, *(round(c * 1e4) for c in normal))
            if key not in index:
                index[key] = len(result.positions)
                result.positions.append(mesh.positions[v])
                result.normals.append(normal)
            corners.append(index[key])
        result.triangles.append(tuple(corners))
    return result


def open_edges(mesh):
    """Directed edges without their opposite: none if the surface is closed and consistently wound."""
    mesh = welded(mesh)
    edges = [(t[i], t[(i + 1) % 3]) for t in mesh.triangles for i in range(3)]
    present = set(edges)
    return sum((b, a) not in present for a, b in edges) + len(edges) - len(present)


def volume(mesh):
    return sum(
        dot(mesh.positions[a], cross(mesh.positions[b], mesh.positions[c])) for a, b, c in mesh.triangles) / 6


def grid_triangles(rows, columns, wrap_rows=False, wrap_columns=False):
    """Two triangles per cell of a rows x columns grid of vertices."""
    triangles = []
    for i in range(rows if wrap_rows else rows - 1):
        for j in range(columns if wrap_columns else columns - 1):
            a, b = i * columns + j, i * columns + (j + 1) % columns
            c, d = (i + 1) % rows * columns + j, (i + 1) % rows * columns + (j + 1) % columns
            triangles += [(a, c, d), (a, d, b)]
    return triangles


# --- shapes ---------------------------------------------------------------------------------------


def rounded(points, times=2, closed=False):
    """Cuts the corners of a polyline (Chaikin), keeping the ends of an open one."""
    for _ in range(times):
        pairs = list(zip(points, points[1:] + points[:1] if closed else points[1:]))
        cut = [tuple(mix(a, b, t) for a, b in zip(p, q)) for p, q in pairs for t in (0.25, 0.75)]
        points = cut if closed else [points[0], *cut[1:-1], points[-1]]
    return points


def lathe(profile, segments):
    """Turns a profile of (radius, y) about the Y axis; going along it, the outside is on the right."""
    angles = [2 * math.pi * k / segments for k in range(segments)]
    positions = [(r * math.sin(a), y, r * math.cos(a)) for r, y in profile for a in angles]
    return welded(
        Mesh(positions, [(a, c, b) for a, b, c in grid_triangles(len(profile), segments, wrap_columns=True)]))


def cylinder(radius, z0, z1, chamfer=0.0, segments=48):
    """Along Z, with chamfered rims."""
    profile = [(0, z0), (radius - chamfer, z0), (radius, z0 + chamfer), (radius, z1 - chamfer),
               (radius - chamfer, z1), (0, z1)]
    return lathe(profile, segments).turned("x", 90)


def ring(outline, inner_radius, half_width, chamfer):
    """A plate across Z, in the plane bounded by the polar `outline` of (angle, radius), with a round hole."""
    sections = []
    for angle, radius in outline:
        profile = [(inner_radius + chamfer, -half_width), (radius - chamfer, -half_width),
                   (radius, chamfer - half_width), (radius, half_width - chamfer),
                   (radius - chamfer, half_width), (inner_radius + chamfer, half_width),
                   (inner_radius, half_width - chamfer), (inner_radius, chamfer - half_width)]
        sections += [(r * math.cos(angle), r * math.sin(angle), z) for r, z in profile]
    triangles = grid_triangles(len(outline), 8, wrap_rows=True, wrap_columns=True)
    return Mesh(sections, triangles)


def circle(radius, segments=96):
    return [(2 * math.pi * k / segments, radius) for k in range(segments)]


def sweep(path, radii, segments=16):
    """A tube with round sections of the given radii along a path, its ends closed."""
    frames, side = [], None
    for k, p in enumerate(path):
        tangent = unit(sub(path[min(k + 1, len(path) - 1)], path[max(k - 1, 0)]))
        if side is None:
            side = cross(tangent, (0, 0, 1) if abs(tangent[2]) < 0.9 else (1, 0, 0))
        side = unit(sub(side, mul(tangent, dot(side, tangent))))  # no twist
        frames.append((p, side, cross(tangent, side)))
    positions = []
    for radius, (p, u, v) in zip([0, *radii, 0], [frames[0], *frames, frames[-1]]):
        for k in range(segments):
            a = 2 * math.pi * k / segments
            positions.append(add(p, add(mul(u, radius * math.cos(a)), mul(v, radius * math.sin(a)))))
    triangles = grid_triangles(len(radii) + 2, segments, wrap_columns=True)
    return welded(Mesh(positions, [(a, c, b) for a, b, c in triangles]))


def extrude(outline, z0, z1, chamfer):
    """A convex, counter-clockwise outline of (x, y) made a plate from z0 to z1 with chamfered rims."""
    middle = tuple(sum(p[k] for p in outline) / len(outline) for k in range(2))

    def inset(p):
        d = math.hypot(p[0] - middle[0], p[1] - middle[1])
        return tuple(middle[k] + (p[k] - middle[k]) * (1 - chamfer / d) for k in range(2))

    inner = [inset(p) for p in outline]
    rows = [[middle] * len(outline), inner, outline, outline, inner, [middle] * len(outline)]
    heights = [z0, z0, z0 + chamfer, z1 - chamfer, z1, z1]
    positions = [(x, y, z) for row, z in zip(rows, heights) for x, y in row]
    return welded(
        Mesh(positions, [(a, c, b) for a, b, c in grid_triangles(6, len(outline), wrap_columns=True)]))


def icosphere(times):
    """The unit sphere from an icosahedron divided `times` times: 20 * 4^times triangles."""
    g = (1 + math.sqrt(5)) / 2
    positions = [
        unit(p)
        for p in [(-1, g,
                   0), (1, g, 0), (-1, -g,
                                   0), (1, -g,
                                        0), (0, -1,
                                             g), (0, 1, g), (0, -1,
                                                             -g), (0, 1, -g), (g, 0, -1), (g, 0,
                                                                                           1), (-g, 0,
                                                                                                -1), (-g, 0,
                                                                                                      1)]
    ]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
                 (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
                 (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(times):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(positions)
                positions.append(unit(add(positions[a], positions[b])))
            return middles[key]

        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = finer
    return Mesh(positions, triangles)


# --- signed distance functions --------------------------------------------------------------------


def ellipsoid(centre, radii):
    """Close to a distance near the surface (Quilez)."""
    def distance(p):
        q = sub(p, centre)
        k0 = math.sqrt(sum((c / r)**2 for c, r in zip(q, radii)))
        k1 = math.sqrt(sum((c / (r * r))**2 for c, r in zip(q, radii)))
        return k0 * (k0 - 1) / k1 if k1 > 0 else -min(radii)

    return distance


def rod(a, b, radius, rounding):
    """A cylinder from a to b with rounded rims."""
    axis = unit(sub(b, a))
    half = length(sub(b, a)) / 2
    centre = mul(add(a, b), 0.5)

    def distance(p):
        q = sub(p, centre)
        along = dot(q, axis)
        dx = length(sub(q, mul(axis, along))) - radius + rounding
        dy = abs(along) - half + rounding
        return min(max(dx, dy), 0) + math.hypot(max(dx, 0), max(dy, 0)) - rounding

    return distance


def smooth_min(a, b, k):
    h = max(k - abs(a - b), 0) / k
    return min(a, b) - h * h * k / 4


def union(k, *shapes):
    """The shapes blended over a width of about k."""
    def distance(p):
        result = shapes[0](p)
        for shape in shapes[1:]:
            result = smooth_min(result, shape(p), k)
        return result

    return distance


def gradient(distance, p, h=1e-4):
    return unit(tuple(distance(add(p, d)) - distance(sub(p, d)) for d in [(h, 0, 0), (0, h, 0), (0, 0, h)]))


def surface_nets(distance, low, high, cell):
    """Meshes the zero level of a distance function (Gibson, "Constrained elastic surface nets", 1998): a
    vertex in each cell the surface crosses, moved onto the surface, and a quadrangle across each grid edge
    it crosses."""
    n = [math.ceil((h - l) / cell) + 1 for l, h in zip(low, high)]
    stride = (1, n[0], n[0] * n[1])
    values = [
        distance((low[0] + i * cell, low[1] + j * cell, low[2] + k * cell)) for k in range(n[2])
        for j in range(n[1]) for i in range(n[0])
    ]
    corners = [(i, j, k) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    edges = [(a, a | 1 << d) for d in range(3) for a in range(8) if not a >> d & 1]
    mesh, vertex_of = Mesh(), {}

    def place(i, j, k):
        crossings = []
        v = [values[(i + a) * stride[0] + (j + b) * stride[1] + (k + c) * stride[2]] for a, b, c in corners]
        for a, b in edges:
            if (v[a] < 0) != (v[b] < 0):
                t = v[a] / (v[a] - v[b])
                crossings.append(tuple(mix(x, y, t) for x, y in zip(corners[a], corners[b])))
        inside = tuple(sum(c) / len(crossings) for c in zip(*crossings))
        p = tuple(l + (o + c) * cell for l, o, c in zip(low, (i, j, k), inside))
        for _ in range(2):
            p = sub(p, mul(gradient(distance, p), distance(p)))
        return p

    def vertex(i, j, k):
        if (i, j, k) not in vertex_of:
            vertex_of[i, j, k] = len(mesh.positions)
            mesh.positions.append(place(i, j, k))
        return vertex_of[i, j, k]

    for k in range(1, n[2] - 1):
        for j in range(1, n[1] - 1):
            for i in range(1, n[0] - 1):
                at = i + j * stride[1] + k * stride[2]
                for d in range(3):
                    if (values[at] < 0) == (values[at + stride[d]] < 0):
                        continue
                    u, w = (tuple(-(a == (d + s) % 3) for a in range(3)) for s in (1, 2))
                    quad = [vertex(*add((i, j, k), o)) for o in [(0, 0, 0), u, add(u, w), w]]
                    add_quad(mesh, quad if values[at] < 0 else quad[::-1])
    mesh = welded(mesh)
    mesh.normals = [gradient(distance, p) for p in mesh.positions]
    return mesh


def add_quad(mesh, quad):
    """As two triangles, along the shorter diagonal."""
    a, b, c, d = quad
    p = mesh.positions
    if length(sub(p[a], p[c])) <= length(sub(p[b], p[d])):
        mesh.triangles += [(a, b, c), (a, c, d)]
    else:
        mesh.triangles += [(a, b, d), (b, c, d)]


# --- files ----------------------------------------------------------------------------------------


@dataclass
class Material:
    name: str
    color: str  # "#rrggbb" as on a screen
    roughness: float = 0.5
    metallic: float = 0.0
    two_sided: bool = False

    def linear(self):
        channels = [int(self.color[k:k + 2], 16) / 255 for k in (1, 3, 5)]
        return [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055)**2.4 for c in channels]


@dataclass
class Node:
    name: str
    parts: list  # of (mesh, material), about the node's origin
    position: tuple = (0, 0, 0)  # in the parent
    children: list = field(default_factory=list)


def write_glb(path, parts):
    """One node with a primitive for each (mesh, material)."""
    write_glb_tree(path, Node(path.stem, parts))


def write_glb_tree(path, root):
    blob, views, accessors, materials, meshes, nodes = b"", [], [], [], [], []

    def store(data, target, **accessor):
        nonlocal blob
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data), "target": target})
        accessors.append({"bufferView": len(views) - 1, **accessor})
        blob += data + b"\0" * (-len(data) % 4)
        return len(accessors) - 1

    def primitive(mesh, material):
        p = [struct.unpack("<3f", struct.pack("<3f", *v)) for v in mesh.positions]
        low, high = ([f(v[k] for v in p) for k in range(3)] for f in (min, max))
        flat = [i for t in mesh.triangles for i in t]
        code, kind = ("H", 5123) if len(p) < 65536 else ("I", 5125)
        attributes = {
            "POSITION":
                store(b"".join(struct.pack("<3f", *v) for v in p), 34962, componentType=5126, count=len(p),
                      type="VEC3", min=low, max=high),
            "NORMAL":
                store(b"".join(struct.pack("<3f", *v) for v in mesh.normals), 34962, componentType=5126,
                      count=len(p), type="VEC3"),
        }
        if mesh.uvs:
            attributes["TEXCOORD_0"] = store(b"".join(struct.pack("<2f", *uv) for uv in mesh.uvs), 34962,
                                             componentType=5126, count=len(p), type="VEC2")
        indices = store(struct.pack(f"<{len(flat)}{code}", *flat), 34963, componentType=kind, count=len(flat),
                        type="SCALAR")
        materials.append({
            "name": material.name,
            "doubleSided": material.two_sided,
            "pbrMetallicRoughness": {
                "baseColorFactor": [round(c, 4) for c in material.linear()] + [1],
                "metallicFactor": material.metallic,
                "roughnessFactor": material.roughness
            }
        })
        return {"attributes": attributes, "indices": indices, "material": len(materials) - 1}

    def place(node):
        index = len(nodes)
        nodes.append({"mesh": len(meshes), "name": node.name})
        meshes.append({"name": node.name, "primitives": [primitive(*part) for part in node.parts]})
        if any(node.position):
            nodes[index]["translation"] = list(node.position)
        if node.children:
            nodes[index]["children"] = [place(child) for child in node.children]
        return index

    place(root)
    document = {
        "asset": {
            "version": "2.0",
            "generator": "offstage assets/make_models.py"
        },
        "scene": 0,
        "scenes": [{
            "nodes": [0]
        }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{
            "byteLength": len(blob)
        }],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + len(blob)
    path.write_bytes(
        struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<I4s", len(text), b"JSON") + text +
        struct.pack("<I4s", len(blob), b"BIN\0") + blob)


def extend_glb(path, camera, light):
    """Adds a node with a camera and one with a light (KHR_lights_punctual) below the root of a GLB.

    Both are dicts: `node` with the node's name and pose, `value` with the camera or the light."""
    data = path.read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    tree, rest = json.loads(data[20:20 + size]), data[20 + size:]
    root = tree["nodes"][tree["scenes"][0]["nodes"][0]]
    root.setdefault("children", []).extend([len(tree["nodes"]), len(tree["nodes"]) + 1])
    tree["nodes"] += [{**camera["node"], "camera": 0},
                      {**light["node"], "extensions": {"KHR_lights_punctual": {"light": 0}}}]
    tree["cameras"] = [camera["value"]]
    tree["extensionsUsed"] = [*tree.get("extensionsUsed", []), "KHR_lights_punctual"]
    tree.setdefault("extensions", {})["KHR_lights_punctual"] = {"lights": [light["value"]]}
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 20 + len(text) + len(rest)) + struct.pack("<I", len(text)) +
                     b"JSON" + text + rest)


def write_obj(path, parts, library):
    lines, first = [f"mtllib {library.name}"], 1
    for mesh, material in parts:
        lines += [f"g {material.name}", f"usemtl {material.name}"]
        lines += ["v %.5f %.5f %.5f" % p for p in mesh.positions]
        lines += ["vn %.4f %.4f %.4f" % n for n in mesh.normals]
        lines += ["f " + " ".join(f"{first + i}//{first + i}" for i in t) for t in mesh.triangles]
        first += len(mesh.positions)
    path.write_text("\n".join(lines) + "\n")


def write_mtl(path, materials):
    """Classic values; the exponent is the one that importers turn back into the roughness."""
    lines = []
    for m in materials:
        channels = " ".join(f"{int(m.color[k : k + 2], 16) / 255:.4f}" for k in (1, 3, 5))
        lines += [
            f"newmtl {m.name}", f"Kd {channels}", "Ks 0.5 0.5 0.5", f"Ns {2 / m.roughness**4 - 2:.2f}",
            f"Pr {m.roughness}", f"Pm {m.metallic}", ""
        ]
    path.write_text("\n".join(lines))


def write_ply(path, mesh):
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.positions)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    header += [
        f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices", "end_header", ""
    ]
    body = b"".join(struct.pack("<6f", *p, *n) for p, n in zip(mesh.positions, mesh.normals))
    body += b"".join(struct.pack("<B3i", 3, *t) for t in mesh.triangles)
    path.write_bytes("\n".join(header).encode() + body)


class GlbWriter:
    """A GLB with textures, a skin and an animation, built piece by piece."""

    def __init__(self):
        self.blob, self.views, self.accessors = b"", [], []
        self.materials, self.meshes, self.images = [], [], []

    def view(self, data):
        self.views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)})
        self.blob += data + b"\0" * (-len(data) % 4)
        return len(self.views) - 1

    def accessor(self, rows, code, **more):
        """`rows`: tuples; `code`: as of struct, such as 3f or 4B."""
        kind = {"f": 5126, "B": 5121, "H": 5123}[code[-1]]
        shape = {"1": "SCALAR", "2": "VEC2", "3": "VEC3", "4": "VEC4", "16": "MAT4"}[code[:-1]]
        data = b"".join(struct.pack("<" + code, *row) for row in rows)
        self.accessors.append({"bufferView": self.view(data), "componentType": kind, "count": len(rows),
                               "type": shape, **more})
        return len(self.accessors) - 1

    def material(self, material, png=None):
        look = {"baseColorFactor": [round(c, 4) for c in material.linear()] + [1],
                "metallicFactor": material.metallic, "roughnessFactor": material.roughness}
        if png:
            self.images.append({"mimeType": "image/png", "bufferView": self.view(png)})
            look["baseColorTexture"] = {"index": len(self.images) - 1}
        self.materials.append({"name": material.name, "pbrMetallicRoughness": look})
        return len(self.materials) - 1

    def primitive(self, mesh, material, **influences):
        """`influences`: further attributes as (rows, code); weights are normalised integers."""
        places = [struct.unpack("<3f", struct.pack("<3f", *p)) for p in mesh.positions]
        low, high = ([f(p[k] for p in places) for k in range(3)] for f in (min, max))
        attributes = {"POSITION": self.accessor(places, "3f", min=low, max=high),
                      "NORMAL": self.accessor(mesh.normals, "3f")}
        if mesh.uvs:
            attributes["TEXCOORD_0"] = self.accessor(mesh.uvs, "2f")
        for name, (rows, code) in influences.items():
            more = {"normalized": True} if name.startswith("WEIGHTS") else {}
            attributes[name] = self.accessor(rows, code, **more)
        indices = self.accessor([(i,) for t in mesh.triangles for i in t], "1H")
        return {"attributes": attributes, "indices": indices, "material": material}

    def mesh(self, primitives):
        self.meshes.append({"primitives": primitives})
        return len(self.meshes) - 1

    def write(self, path, nodes, roots, joints, unbind, clip, times, tracks):
        """`tracks`: (node, property, values at the times)."""
        skin = {"joints": list(joints), "inverseBindMatrices": self.accessor(unbind, "16f")}
        moments = self.accessor([(t,) for t in times], "1f", min=[times[0]], max=[times[-1]])
        samplers = [{"input": moments, "output": self.accessor(values, f"{len(values[0])}f")} for _, _, values in tracks]
        channels = [{"sampler": i, "target": {"node": node, "path": what}} for i, (node, what, _) in enumerate(tracks)]
        document = {"asset": {"version": "2.0", "generator": "offstage assets/make_models.py"},
                    "scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes, "meshes": self.meshes,
                    "materials": self.materials, "skins": [skin],
                    "animations": [{"name": clip, "samplers": samplers, "channels": channels}],
                    "accessors": self.accessors, "bufferViews": self.views, "buffers": [{"byteLength": len(self.blob)}]}
        if self.images:
            document["images"] = self.images
            document["textures"] = [{"source": i} for i in range(len(self.images))]
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        size = 12 + 8 + len(text) + 8 + len(self.blob)
        path.write_bytes(
            struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<I4s", len(text), b"JSON") + text +
            struct.pack("<I4s", len(self.blob), b"BIN\0") + self.blob)
