"""Run by Blender: draws a scene of this folder, for a comparison with our picture of it.

    offstage export chrome.json -o chrome.glb --frames 1
    blender --background --python pair.py -- chrome.json chrome.glb cycles64.png CYCLES 64

The shapes and materials come from the glTF file, and camera, sun, lamps and sky from the scene, with the same
radiances. Blender has Z up: its importer turns (x, y, z) to (x, -z, y).
"""

import json
import math
import re
import resource
import sys

import bpy
import mathutils
import numpy as np

if not hasattr(np, "bool"):  # the importer of Blender 3.4 uses a name that numpy 1.24 no longer has
    np.bool = bool


def z_up(v):
    return mathutils.Vector((v[0], -v[2], v[1]))


def add_light(kind, name, place, towards, color, **settings):
    light = bpy.data.lights.new(name, kind)
    light.color = color
    for key, value in settings.items():
        setattr(light, key, value)
    thing = bpy.data.objects.new(name, light)
    thing.location = place
    thing.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(thing)


def add_lights(lights):
    for k, light in enumerate(lights):
        color = light.get("color", [1, 1, 1])
        intensity = light.get("intensity", 10)
        if light["type"] == "sun":
            # offstage gives the radiance of a white surface that faces the light. Blender needs the
            # irradiance.
            add_light("SUN", "sun", mathutils.Vector(), -z_up(light["direction"]), color,
                      energy=math.pi * light.get("intensity", 3), angle=math.radians(light.get("size_deg", 1.5)))
        elif light["type"] == "point":
            add_light("POINT", f"lamp {k}", z_up(light["position"]), mathutils.Vector((0, 0, -1)), color,
                      energy=4 * math.pi**2 * intensity, shadow_soft_size=light.get("radius", 0.1))


def add_sky(environment, sun):
    """A picture of the gradient of render/sky.cpp."""
    height, width = 256, 512
    zenith, horizon, ground = (np.array(environment[key]) for key in ("zenith", "horizon", "ground"))
    elevation = (np.arange(height) + 0.5) / height * math.pi - 0.5 * math.pi
    around = ((np.arange(width) + 0.5) / width - 0.5) * 2 * math.pi
    up = np.sin(elevation)[:, None] * np.ones(width)
    # Blender's equirectangular pictures have +X in the middle.
    x = np.cos(elevation)[:, None] * np.cos(around)
    y = np.cos(elevation)[:, None] * -np.sin(around)
    u = 1 - np.clip(up, 0, 1)
    low = 0.3 * u**2 + 0.7 * u**8
    sky = zenith + low[..., None] * (horizon - zenith)
    if sun is not None:
        d = z_up(sun["direction"]).normalized()
        towards = np.clip(x * d.x + y * d.y + up * d.z, 0, 1)
        risen = min(max(0.5 + 5 * d.z, 0), 1)
        glow = 0.12 * risen * sun.get("intensity", 3) * np.array(sun.get("color", [1, 0.95, 0.87]))
        sky = sky + (0.25 * towards**8 + 0.75 * towards**64)[..., None] * glow
    picture = np.where(up[..., None] < 0, ground, sky)
    image = bpy.data.images.new("sky", width, height, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.dstack([picture, np.ones((height, width))]).astype(np.float32).ravel())
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    nodes = world.node_tree.nodes
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    world.node_tree.links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    bpy.context.scene.world = world


def add_camera(camera):
    thing = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    thing.data.sensor_fit = "VERTICAL"
    thing.data.angle_y = math.radians(camera["fov_deg"])
    eye, target = z_up(camera["eye"]), z_up(camera["target"])
    thing.location = eye
    thing.rotation_euler = (target - eye).to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(thing)
    bpy.context.scene.camera = thing


def make_translucent(name, fraction):
    """Cloth: light that falls on one side leaves on both."""
    for material in bpy.data.materials:
        if not material.name.startswith(name) or not material.use_nodes:
            continue
        nodes, links = material.node_tree.nodes, material.node_tree.links
        principled = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
        output = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
        through = nodes.new("ShaderNodeBsdfTranslucent")
        through.inputs["Color"].default_value = principled.inputs["Base Color"].default_value
        mix = nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = fraction
        links.new(principled.outputs[0], mix.inputs[1])
        links.new(through.outputs[0], mix.inputs[2])
        links.new(mix.outputs[0], output.inputs["Surface"])


def main():
    scene_file, model_file, picture, engine, samples = sys.argv[sys.argv.index("--") + 1:]
    scene = json.loads(re.sub(r"^\s*//.*$", "", open(scene_file).read(), flags=re.M))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=model_file)
    for thing in list(bpy.data.objects):
        if thing.type in ("LIGHT", "CAMERA"):
            bpy.data.objects.remove(thing)
    for material in scene["materials"]:
        if "fabric" in material:
            make_translucent(material["name"], material["fabric"]["translucency"])
    lights = scene.get("lights", [])
    add_lights(lights)
    add_sky(scene["environment"], next((light for light in lights if light["type"] == "sun"), None))
    add_camera(scene["camera"])

    settings = bpy.context.scene
    settings.frame_set(0)
    settings.render.engine = engine
    settings.render.resolution_x, settings.render.resolution_y = scene["render"]["size"]
    settings.render.threads_mode, settings.render.threads = "FIXED", 1
    settings.view_settings.view_transform = "Standard"
    settings.view_settings.exposure = math.log2(scene["render"].get("exposure", 1))
    settings.render.filepath = picture
    if engine == "CYCLES":
        settings.cycles.samples = int(samples)
        settings.cycles.use_denoising = False
        settings.cycles.use_adaptive_sampling = False
    else:
        settings.eevee.taa_render_samples = int(samples)
        settings.eevee.use_gtao = settings.eevee.use_ssr = settings.eevee.use_ssr_refraction = True
        settings.eevee.use_soft_shadows = True
    before = resource.getrusage(resource.RUSAGE_SELF)
    bpy.ops.render.render(write_still=True)
    after = resource.getrusage(resource.RUSAGE_SELF)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"pair: {engine} {samples}: {used:.1f} CPU s")


main()
