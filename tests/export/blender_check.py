"""Run by Blender: imports a film, compares positions at five frames, and draws the last one by Cycles.

blender --background --python blender_check.py -- FILM.glb TRACE.csv PICTURE.png
blender --background --python blender_check.py -- FOLDER_OF_PLY TABLE.csv PICTURE.png

Blender has Z up: the importers turn (x, y, z) to (x, -z, y).
"""

import csv
import glob
import os
import sys

import bpy
import numpy as np

TOLERANCE = 1e-5

# The glTF importer of Debian 12's Blender 3.4 uses a name that Debian 12's numpy 1.24 no longer has.
if not hasattr(np, "bool"):
    np.bool = bool


def y_up(v):
    return np.array([v[0], v[2], -v[1]])


def frames_of(count):
    return [1 + round(k * (count - 1) / 4) for k in range(5)]


def check_gltf(film, trace_file):
    rows = list(csv.DictReader(open(trace_file)))
    times = sorted({float(row["time"]) for row in rows})
    fps = round(1 / (times[1] - times[0]))
    scene = bpy.context.scene
    scene.render.fps = fps
    bpy.ops.import_scene.gltf(filepath=film)
    trace = {(round(float(row["time"]) * fps), row["object"]): [float(row[k]) for k in "xyz"] for row in rows}
    names = {name for _, name in trace}
    compared, worst = 0, 0.0
    for frame in frames_of(len(times)):
        # The importer puts time 0 at frame 0.
        scene.frame_set(frame - 1)
        for thing in bpy.data.objects:
            if thing.name not in names or thing.animation_data is None and thing.type != "MESH":
                continue
            if thing.data is not None and getattr(thing.data, "shape_keys", None):
                evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
                places = np.array([thing.matrix_world @ v.co for v in evaluated.vertices])
                # The trace contains the centre of mass, which is close to the mean of the vertices for an
                # even grid.
                error = np.abs(y_up(places.mean(axis=0)) - trace[frame - 1, thing.name]).max()
                assert error < 0.02, f"{thing.name} at frame {frame}: {error}"
            else:
                error = np.abs(y_up(thing.matrix_world.translation) - trace[frame - 1, thing.name]).max()
                worst = max(worst, error)
                assert error < TOLERANCE, f"{thing.name} at frame {frame}: {error}"
            compared += 1
    assert compared >= 5, "nothing was compared"
    print(f"check: {os.path.basename(film)}: {compared} positions at five frames, largest error {worst:.1e} m")


def check_ply(folder, table_file):
    files = sorted(glob.glob(folder + "/*.ply"))
    table = {}
    for row in csv.DictReader(open(table_file)):
        if row["kind"] == "particle":
            table.setdefault(int(row["frame"]), []).append([float(row[k]) for k in "xyz"])
    compared = 0
    for frame in frames_of(len(files)):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.import_mesh.ply(filepath=files[frame - 1])
        mesh = bpy.context.selected_objects[0].data
        in_faces = {i for polygon in mesh.polygons for i in polygon.vertices}
        loose = np.array([v.co for v in mesh.vertices if v.index not in in_faces]).reshape(-1, 3)
        wanted = np.array(table.get(frame, [])).reshape(-1, 3)
        assert loose.shape == wanted.shape, f"frame {frame}: {len(loose)} particles instead of {len(wanted)}"
        if len(wanted):
            assert np.abs(loose - wanted).max() < TOLERANCE
        compared += len(wanted)
    print(f"check: {folder}: {compared} particles at five frames")
    show_particles(loose)


def show_particles(places):
    """Shows the imported particles as small balls. PLY does not state the up axis, which is Y here, so the object is turned."""
    thing = bpy.context.selected_objects[0]
    thing.rotation_euler = (np.pi / 2, 0, 0)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.02)
    ball = bpy.context.object
    points = bpy.data.meshes.new("particles")
    points.from_pydata([(p[0], -p[2], p[1]) for p in places], [], [])
    owner = bpy.data.objects.new("particles", points)
    bpy.context.collection.objects.link(owner)
    ball.parent = owner
    owner.instance_type = "VERTS"
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (0, -7, 2.5), (1.35, 0, 0)
    scene.camera = camera
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3, (0.6, 0.3, 0)
    bpy.context.collection.objects.link(sun)


def draw(picture):
    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = next(thing for thing in bpy.data.objects if thing.type == "CAMERA")
    sky = bpy.data.worlds.new("sky")
    sky.use_nodes = True
    sky.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0.65, 0.9, 1)
    scene.world = sky
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    scene.cycles.device = "CPU"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 320, 180, 100
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(picture)
    pixels = np.array(image.pixels[:]).reshape(-1, 4)[:, :3]
    assert pixels.std() > 0.02, "the picture is empty"
    print(f"check: {os.path.basename(picture)} was drawn, standard deviation of its pixels {pixels.std():.2f}")


film, table, picture = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
if film.endswith(".glb"):
    check_gltf(film, table)
else:
    check_ply(film, table)
draw(picture)
