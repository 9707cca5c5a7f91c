#!/usr/bin/env python3
"""Exported films have the simulated motion: positions agree with the trace to 1e-5 m, in every format.

usage: export_test.py OFFSTAGE SOURCE_DIR
"""

import bisect
import csv
import json
import math
import os
import subprocess
import sys
import tempfile

from look_model import write_look_model
from readers import Gltf, UsdText, read_ply

TOLERANCE = 1e-5  # m; positions of a few metres as float32 have errors of 2e-7
FRAMES = (1, 5, 11, 17, 24)
FPS = 24
program, source = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
scene = source + "/tests/data/export.json"


def offstage(*arguments, code=0):
    run = subprocess.run([program, *arguments], capture_output=True, text=True)
    assert run.returncode == code, f"{arguments}: {run.returncode}\n{run.stdout}{run.stderr}"
    return run


def distance(a, b):
    return max(abs(x - y) for x, y in zip(a, b))


def read_trace(path):
    """Position by (frame, object)."""
    rows = {}
    for row in csv.DictReader(open(path)):
        rows[round(float(row["time"]) * FPS) + 1, row["object"]] = tuple(float(row[k]) for k in "xyz")
    return rows


def read_table(path):
    rows = {}
    for row in csv.DictReader(open(path)):
        rows[int(row["frame"]), row["kind"], row["object"], int(row["id"])] = tuple(float(row[k]) for k in "xyz")
    return rows


def centre_of_cloth(points, triangles, flat):
    """Centre of mass: each vertex has a third of the mass of its triangles, which is proportional to their area in the flat cloth."""
    total, centre = 0.0, [0.0, 0.0, 0.0]
    for triangle in triangles:
        (ax, ay), (bx, by), (cx, cy) = (flat[i] for i in triangle)
        area = abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2
        total += area
        for i in triangle:
            for k in range(3):
                centre[k] += area / 3 * points[i][k]
    return [c / total for c in centre]


def check_usd(trace, table):
    offstage("export", scene, "-o", "film.usda", "-q")
    layer = UsdText("film.usda").root
    assert layer.metadata["upAxis"] == '"Y"' and layer.metadata["metersPerUnit"] == 1
    assert layer.metadata["timeCodesPerSecond"] == FPS and layer.metadata["endTimeCode"] == FPS
    world = layer.find("World")
    for name, prim in {"box/1": "box_1", "box 1": "box_1_2", "wheel": "wheel"}.items():
        for frame in FRAMES:
            assert distance(world.find(prim).at("xformOp:translate", frame), trace[frame, name]) < TOLERANCE, name
    turning = world.find("wheel").attributes["xformOp:orient.timeSamples"]
    assert len(turning) == FPS and all(abs(sum(x * x for x in q) - 1) < 1e-5 for q in turning.values())

    cloth = world.find("flag")
    counts = cloth.attributes["faceVertexCounts.timeSamples"]
    assert len(counts) > 1, "the cloth tore, so its triangles change"
    first_tear = sorted(counts)[1]
    assert len(cloth.at("points", first_tear)) > 49 == len(cloth.at("points", 1))
    for frame in range(1, FPS + 1):
        indices, points = cloth.at("faceVertexIndices", frame), cloth.at("points", frame)
        assert max(indices) < len(points) == len(cloth.at("normals", frame)) == len(cloth.at("velocities", frame))
        triangles = [tuple(int(i) for i in indices[k:k + 3]) for k in range(0, len(indices), 3)]
        if frame < first_tear:
            centre = centre_of_cloth(points, triangles, cloth.at("primvars:st", frame))
            assert distance(centre, trace[frame, "flag"]) < TOLERANCE, frame

    ball, fountain = world.find("ball"), world.find("fountain")
    for frame in FRAMES:
        assert distance(ball.at("points", frame)[0], trace[frame, "ball/0"]) < TOLERANCE
        ids, points = fountain.at("ids", frame), fountain.at("points", frame)
        assert len(ids) == len(points) == len(fountain.at("widths", frame)) == len(fountain.at("primvars:displayColor", frame))
        for i, point in zip(ids, points):
            assert distance(point, table[frame, "particle", "fountain", int(i)]) == 0
    assert len(fountain.at("ids", 24)) > 20 and fountain.at("ids", 24)[0] > 0, "old particles died"
    assert distance(fountain.at("widths", 24), [0.024] * 100) < 1e-7

    names = {m.name for m in world.find("Materials").children}
    assert "red_paint" in names and "glass" in names
    surface = world.find("Materials").find("glass").find("Surface")
    assert surface.attributes["info:id"] == '"UsdPreviewSurface"' and abs(surface.attributes["inputs:ior"] - 1.4) < 1e-6
    meshes = layer.find("_Meshes")
    for prim in world.of_kind("Xform"):
        for part in prim.children:
            assert part.metadata["references"].startswith("</_Meshes/mesh_")
            meshes.find(part.metadata["references"][len("</_Meshes/"):-1])
            assert part.attributes["material:binding"].split("/")[-1].rstrip(">") in names
    assert [p.kind for p in world.children if p.kind.endswith("Light")] == ["DistantLight", "DomeLight", "SphereLight"]
    eye = world.find("Camera").at("xformOp:transform", 1)[3][:3]
    assert distance(eye, (0, 2.3, 5)) < 1e-5, eye
    return world


def check_gltf(trace, usd):
    run = offstage("export", scene, "-o", "film.glb")
    assert "2 particle systems are not exported" in run.stderr, run.stderr
    film = Gltf("film.glb")
    for name in ("box/1", "box 1", "wheel", "ground"):
        for frame in FRAMES:
            wanted = trace.get((frame, name), (0, 0, 0))
            assert distance(film.translation(name, (frame - 1) / FPS), wanted) < TOLERANCE, name
    stretches = [i for i, node in enumerate(film.json["nodes"]) if node.get("name", "").startswith("flag")]
    assert len(stretches) == len(usd.find("flag").attributes["faceVertexCounts.timeSamples"])
    for frame in FRAMES:
        time = (frame - 1) / FPS
        shown = [n for n in stretches if film.animated(n, "scale", time) == (1, 1, 1)]
        assert len(shown) == 1, "one mesh of the torn cloth is there at a time"
        points = usd.find("flag").at("points", frame)
        got = film.cloth_points(shown[0], time)
        assert len(got) == len(points) and all(distance(a, b) < TOLERANCE for a, b in zip(got, points))
    assert {"KHR_lights_punctual", "KHR_materials_transmission"} <= set(film.json["extensionsUsed"])


def check_sequences(table, usd):
    offstage("export", scene, "-o", "ply/f####.ply", "-q", "--frames", "1-24x23")
    assert sorted(os.listdir("ply")) == ["f0001.ply", "f0024.ply"]
    vertices, triangles = read_ply("ply/f0024.ply")
    particles = [i for i, radius in enumerate(vertices["radius"]) if radius > 0]
    in_faces = {i for triangle in triangles for i in triangle}
    assert particles and not in_faces & set(particles) and max(in_faces) < len(vertices["x"])
    fountain = max(vertices["object"])
    for i in particles:
        if vertices["object"][i] == fountain:
            wanted = table[24, "particle", "fountain", vertices["id"][i]]
            assert distance((vertices["x"][i], vertices["y"][i], vertices["z"][i]), wanted) < TOLERANCE
    cloth = [p for p in usd.find("flag").at("points", 24)]
    by_x = sorted(zip(vertices["x"], vertices["y"], vertices["z"]))
    for p in cloth:
        first = bisect.bisect_left(by_x, (p[0] - TOLERANCE,))
        last = bisect.bisect_right(by_x, (p[0] + TOLERANCE, math.inf))
        assert any(distance(p, q) < TOLERANCE for q in by_x[first:last]), "the cloth is among the vertices"

    offstage("export", scene, "-o", "obj/f####.obj", "-q", "--frames", "24")
    lines = open("obj/f0024.obj").read().split("\n")
    assert sum(line.startswith("v ") for line in lines) == len(vertices["x"])
    assert sum(line.startswith("f ") for line in lines) == len(triangles)
    used = {line.split()[1] for line in lines if line.startswith("usemtl")}
    made = {line.split()[1] for line in open("obj/f.mtl") if line.startswith("newmtl")}
    assert used <= made and "mtllib f.mtl" in lines


def resolved(film, material):
    """A material with its textures replaced by their samplers and the bytes of their pictures."""
    def visit(value):
        if isinstance(value, list):
            return [visit(v) for v in value]
        if not isinstance(value, dict):
            return round(value, 4) if isinstance(value, float) else value
        out = {key: visit(v) for key, v in value.items()}
        if "index" in out:
            texture = film.json["textures"][out.pop("index")]
            view = film.json["bufferViews"][film.json["images"][texture["source"]]["bufferView"]]
            out["picture"] = film.binary[view["byteOffset"]:view["byteOffset"] + view["byteLength"]]
            out["sampler"] = film.json["samplers"][texture["sampler"]]
        return out
    return visit(film.json["materials"][material])


def looks_of(path):
    """The materials of a film by name, and the attributes of their meshes."""
    film = Gltf(path)
    looks = {}
    for mesh in film.json["meshes"]:
        for primitive in mesh["primitives"]:
            material = resolved(film, primitive["material"])
            material["attributes"] = sorted(primitive["attributes"])
            looks[material["name"]] = material
    return looks


def check_looks():
    """A model keeps its materials through two exports, and each format reports what it cannot hold."""
    write_look_model("model.gltf")

    def export(model, out):
        with open("looks.json", "w") as file:
            json.dump({"version": 1, "materials": [{"name": "tiles", "pattern": "checker"}],
                       "bodies": [{"motion": "static", "material": "tiles"},
                                  {"motion": "static", "collides": False, "shape": {"type": "mesh", "file": model}}],
                       "output": {"duration": 0.04}}, file)
        return offstage("export", "looks.json", "-o", out).stderr

    notes = export("model.gltf", "looks.glb")
    assert "glTF has no procedural patterns; those of material 'tiles' are replaced by their first colour" in notes, notes
    assert notes.count("glTF has no") == 2 and "light of the sky" in notes, notes
    looks = looks_of("looks.glb")
    assert "COLOR_0" in looks["colours"]["attributes"] and "COLOR_0" not in looks["leaf"]["attributes"]
    assert looks["leaf"]["alphaMode"] == "MASK" and looks["leaf"]["alphaCutoff"] == 0.25 and looks["leaf"]["doubleSided"]
    assert looks["blend"]["alphaMode"] == "BLEND" and "alphaMode" not in looks["colours"]
    assert looks["relief"]["normalTexture"]["scale"] == 0.5 and looks["relief"]["occlusionTexture"]["strength"] == 0.5
    sampled = looks["sampled"]["pbrMetallicRoughness"]["baseColorTexture"]
    assert sampled["sampler"] == {"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33648}
    assert sampled["extensions"]["KHR_texture_transform"] == {"offset": [0.25, 0.5], "rotation": 0.5, "scale": [2, 3]}
    glass, sheet = looks["solid glass"]["extensions"], looks["sheet"]["extensions"]
    assert glass["KHR_materials_volume"]["thicknessFactor"] > 0 and glass["KHR_materials_ior"]["ior"] == 1.25
    assert "KHR_materials_volume" not in sheet and "KHR_materials_specular" not in glass
    assert looks["glow"]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] == 4
    assert looks["lacquer"]["extensions"]["KHR_materials_clearcoat"] == {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25}
    assert looks["flat"]["extensions"] == {"KHR_materials_unlit": {}}
    export("looks.glb", "again.glb")
    again = looks_of("again.glb")
    for name, look in looks.items():
        same = dict(again[name])
        assert same == look, f"{name}:\n{look}\n{same}"

    notes = export("model.gltf", "looks.usda")
    for lost in ("procedural patterns", "vertex colours; those of material 'colours'", "refraction and transmission",
                 "layers of sheen"):
        assert lost in notes, notes
    materials = UsdText("looks.usda").root.find("World").find("Materials")
    leaf = materials.find("leaf").find("Surface").attributes
    assert leaf["inputs:opacityThreshold"] == 0.25 and leaf["inputs:opacity.connect"].endswith("Texture.outputs:a>")
    assert "NormalTexture" in materials.find("relief").find("Surface").attributes["inputs:normal.connect"]
    turned = materials.find("sampled").find("TextureTransform").attributes
    assert distance(turned["inputs:scale"], (2, 3)) < 1e-5 and abs(turned["inputs:rotation"] - math.degrees(0.5)) < 1e-3
    notes = export("model.gltf", "ply/looks##.ply")
    for lost in ("PLY has no textures", "PLY has no normal maps", "PLY has no camera"):
        assert lost in notes and "vertex colours" not in notes, notes
    vertices, _ = read_ply("ply/looks01.ply")
    assert {(255, 0, 0), (0, 255, 0), (0, 0, 255)} <= set(zip(vertices["red"], vertices["green"], vertices["blue"]))
    assert "OBJ has no procedural patterns" in export("model.gltf", "obj/looks##.obj")
    mtl = open("obj/looks.mtl").read()
    assert "map_d looks.leaf.png" in mtl and "norm -bm 0.5 looks.relief.Normal.png" in mtl and "map_Ke" in mtl
    assert any(len(line.split()) == 7 for line in open("obj/looks01.obj") if line.startswith("v ")), "vertex colours"


def check_command():
    offstage("simulate", scene, "--cache", "cache", "-q")
    offstage("export", scene, "-o", "cached.usda", "--cache", "cache", "-q")
    assert open("cached.usda").read() == open("film.usda").read(), "a cache gives the same film"
    assert "exists already" in offstage("export", scene, "-o", "film.glb", code=2).stderr
    for out, advice in {"f.usdc": ".usda", "f.gltf": ".glb", "f.abc": "Alembic", "f.ply": "f_####.ply", "#.csv": "leave out",
                        "f.fbx": "must end in"}.items():
        assert advice in offstage("export", scene, "-o", out, code=2).stderr, out


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    offstage("simulate", scene, "--trace", "trace.csv", "-q")
    offstage("export", scene, "-o", "film.csv", "-q")
    trace, table = read_trace("trace.csv"), read_table("film.csv")
    usd = check_usd(trace, table)
    check_gltf(trace, usd)
    check_sequences(table, usd)
    check_looks()
    check_command()
print("ok")
