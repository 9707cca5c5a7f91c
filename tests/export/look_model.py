"""A glTF model with every kind of material that offstage can draw, and its pictures."""

import base64
import json
import struct
import zlib


def png(pixels, width):
    """A PNG file of RGBA pixels."""
    rows = b"".join(b"\0" + bytes(sum(pixels[i:i + width], ())) for i in range(0, len(pixels), width))

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, len(pixels) // width, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def write_look_model(path):
    """Writes squares beside each other, each with one material."""
    opaque = png([(255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255), (255, 255, 255, 255)], 2)
    holes = png([(0, 255, 0, 255), (0, 255, 0, 0), (0, 255, 0, 0), (0, 255, 0, 255)], 2)
    relief = png([(128, 128, 255, 255), (200, 128, 230, 255), (128, 200, 230, 255), (128, 128, 255, 255)], 2)
    pictures = [opaque, holes, relief]
    turn = {"KHR_texture_transform": {"offset": [0.25, 0.5], "rotation": 0.5, "scale": [2, 3]}}

    def painted(texture, **more):
        return {"pbrMetallicRoughness": {"baseColorTexture": {"index": texture, **more}, "metallicFactor": 0}}

    materials = [
        {"name": "colours", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.75}},
        {"name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": True, **painted(1)},
        {"name": "blend", "alphaMode": "BLEND", **painted(1)},
        {"name": "relief", "normalTexture": {"index": 2, "scale": 0.5}, "occlusionTexture": {"index": 0, "strength": 0.5},
         **painted(0, texCoord=1)},
        {"name": "sampled", **painted(3, extensions=turn)},
        {"name": "glow", "emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": 0},
         "pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 0}},
         "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}},
        {"name": "solid glass", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
         "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1, "transmissionTexture": {"index": 0}},
                        "KHR_materials_volume": {"thicknessFactor": 0.5}, "KHR_materials_ior": {"ior": 1.25}}},
        {"name": "sheet", "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}},
        {"name": "lacquer", "extensions": {
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25},
            "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 0], "sheenRoughnessFactor": 0.5},
            "KHR_materials_specular": {"specularColorFactor": [0.5, 0.5, 0.25], "specularColorTexture": {"index": 0}}}},
        {"name": "flat", "extensions": {"KHR_materials_unlit": {}}},
        {"name": "glossy", "extensions": {"KHR_materials_pbrSpecularGlossiness": {
            "diffuseFactor": [1, 0.5, 0.5, 1], "specularFactor": [0.5, 0.5, 0.25], "glossinessFactor": 0.75}}},
    ]
    data, views, accessors = b"", [], []

    def accessor(numbers, kind, count, code="f", component=5126):
        nonlocal data
        packed = struct.pack(f"<{len(numbers)}{code}", *numbers)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
        data += packed
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": count, "type": kind})
        return len(accessors) - 1

    uvs = accessor([0, 1, 1, 1, 1, 0, 0, 0], "VEC2", 4)
    other_uvs = accessor([0, 2, 2, 2, 2, 0, 0, 0], "VEC2", 4)
    normals = accessor([0, 0, 1] * 4, "VEC3", 4)
    colors = accessor([1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 1, 1, 1, 1], "VEC4", 4)
    indices = accessor([0, 1, 2, 0, 2, 3], "SCALAR", 6, "I", 5125)
    primitives = []
    for i, material in enumerate(materials):
        x = 1.2 * i - 6
        corners = accessor([x, 0, 0, x + 1, 0, 0, x + 1, 1, 0, x, 1, 0], "VEC3", 4)
        accessors[corners].update(min=[x, 0, 0], max=[x + 1, 1, 0])
        attributes = {"POSITION": corners, "NORMAL": normals, "TEXCOORD_0": uvs, "TEXCOORD_1": other_uvs}
        if material["name"] == "colours":
            attributes["COLOR_0"] = colors
        primitives.append({"attributes": attributes, "indices": indices, "material": i})
    model = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}], "materials": materials, "accessors": accessors, "bufferViews": views,
        "textures": [{"source": 0}, {"source": 1}, {"source": 2}, {"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        "images": [{"uri": "data:image/png;base64," + base64.b64encode(p).decode()} for p in pictures],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
    }
    with open(path, "w", encoding="utf-8") as file:
        json.dump(model, file)
