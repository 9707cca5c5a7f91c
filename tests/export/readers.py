"""Small readers of exported files (USD text, glTF binary, PLY), independent of the program."""

import json
import re
import struct

TOKEN = re.compile(r'\s*(?:#[^\n]*\n\s*)*("(?:\\.|[^"\\])*"|@[^@]*@|<[^>]*>|[A-Za-z_][\w:.\[\]]*|-?inf|-?[\d.]+(?:e[-+]?\d+)?|.)',
                   re.S)


class Prim:
    def __init__(self, kind, name):
        self.kind, self.name, self.metadata, self.children = kind, name, {}, []
        self.attributes, self.types = {}, {}

    def find(self, name):
        return next(child for child in self.children if child.name == name)

    def of_kind(self, kind):
        return [child for child in self.children if child.kind == kind]

    def at(self, attribute, time):
        """The value at a time, as USD interpolates: linear for reals of equal shape, held for others."""
        if attribute + ".timeSamples" not in self.attributes:
            return self.attributes[attribute]
        samples = self.attributes[attribute + ".timeSamples"]
        before = max((t for t in samples if t <= time), default=min(samples))
        after = min((t for t in samples if t >= time), default=max(samples))
        if before == after or self.types[attribute + ".timeSamples"].startswith(("int", "bool", "token", "string")):
            return samples[before]
        fraction = (time - before) / (after - before)
        return blend(samples[before], samples[after], fraction)


def blend(a, b, fraction):
    if isinstance(a, (tuple, list)):
        return type(a)(blend(x, y, fraction) for x, y in zip(a, b)) if len(a) == len(b) else a
    return a + fraction * (b - a) if isinstance(a, float) else a


class UsdText:
    """Reads a .usda file: its layer metadata, and the tree of prims below `root`."""

    def __init__(self, path):
        text = open(path, encoding="utf-8").read()
        assert text.startswith("#usda 1.0\n"), "no header"
        self.tokens = TOKEN.findall(text[10:] + " ")
        while self.tokens and not self.tokens[-1].strip():
            self.tokens.pop()
        self.place = 0
        self.root = Prim("", "")
        if self.peek() == "(":
            self.root.metadata = self.metadata()
        while self.place < len(self.tokens):
            self.root.children.append(self.prim())

    def peek(self):
        return self.tokens[self.place]

    def take(self, wanted=None):
        token = self.tokens[self.place]
        assert wanted is None or token == wanted, f"{token} instead of {wanted} at token {self.place}"
        self.place += 1
        return token

    def metadata(self):
        self.take("(")
        found = {}
        while self.peek() != ")":
            words = [self.take()]
            while self.peek() != "=":
                words.append(self.take())
            self.take("=")
            found[words[-1]] = self.value()
        self.take(")")
        return found

    def prim(self):
        assert self.take() in ("def", "class", "over")
        kind = "" if self.peek().startswith('"') else self.take()
        prim = Prim(kind, self.take().strip('"'))
        assert re.fullmatch(r"[A-Za-z_]\w*", prim.name), f"{prim.name} is no name of a prim"
        if self.peek() == "(":
            prim.metadata = self.metadata()
        self.take("{")
        while self.peek() != "}":
            if self.peek() in ("def", "class", "over"):
                prim.children.append(self.prim())
            else:
                self.attribute(prim)
        self.take("}")
        names = [child.name for child in prim.children]
        assert len(names) == len(set(names)), "two prims of one name"
        return prim

    def attribute(self, prim):
        words = [self.take()]
        if words[0] == "uniform":
            words.append(self.take())
        name = self.take()
        prim.attributes.setdefault(name, None)
        prim.types[name] = words[-1]
        if self.peek() == "=":
            self.take("=")
            prim.attributes[name] = self.value()
        if self.peek() == "(":
            self.metadata()

    def value(self):
        token = self.take()
        if token == "(":
            return tuple(self.items(")"))
        if token == "[":
            return self.items("]")
        if token == "{":
            samples = {}
            while self.peek() != "}":
                time = float(self.take())
                self.take(":")
                samples[time] = self.value()
                if self.peek() == ",":
                    self.take()
            self.take("}")
            return samples
        if token[0] in '"@<':
            return token
        try:
            return float(token)
        except ValueError:
            return token

    def items(self, end):
        found = []
        while self.peek() != end:
            found.append(self.value())
            if self.peek() == ",":
                self.take()
        self.take(end)
        return found


class Gltf:
    """Reads a .glb file; animated values of nodes at a time."""

    WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}

    def __init__(self, path):
        data = open(path, "rb").read()
        magic, version, length, json_length, json_kind = struct.unpack("<4sIII4s", data[:20])
        assert (magic, version, length, json_kind) == (b"glTF", 2, len(data), b"JSON")
        self.json = json.loads(data[20:20 + json_length])
        binary_length, binary_kind = struct.unpack("<I4s", data[20 + json_length:28 + json_length])
        assert binary_kind == b"BIN\0"
        self.binary = data[28 + json_length:]
        assert len(self.binary) == binary_length == self.json["buffers"][0]["byteLength"]

    def accessor(self, index):
        accessor = self.json["accessors"][index]
        view = self.json["bufferViews"][accessor["bufferView"]]
        width = self.WIDTH[accessor["type"]]
        code = {5126: "f", 5125: "I"}[accessor["componentType"]]
        start = view["byteOffset"]
        numbers = struct.unpack_from(f"<{accessor['count'] * width}{code}", self.binary, start)
        assert accessor["count"] * width * 4 <= view["byteLength"]
        if width == 1:
            return list(numbers)
        return [numbers[i:i + width] for i in range(0, len(numbers), width)]

    def node(self, name):
        return next(i for i, node in enumerate(self.json["nodes"]) if node.get("name") == name)

    def animated(self, node, path, time):
        """The value of a node's property at a time, or None if it is not animated."""
        for animation in self.json.get("animations", []):
            for channel in animation["channels"]:
                if channel["target"] != {"node": node, "path": path}:
                    continue
                sampler = animation["samplers"][channel["sampler"]]
                times, values = self.accessor(sampler["input"]), self.accessor(sampler["output"])
                width = len(values) // len(times)
                if path == "weights":
                    values = [tuple(values[i:i + width]) for i in range(0, len(values), width)]
                after = next((i for i, t in enumerate(times) if t >= time - 1e-6), len(times) - 1)
                before = max(after - 1, 0) if times[after] > time + 1e-6 else after
                if before == after:
                    return values[after]
                if sampler["interpolation"] == "STEP":
                    return values[before]
                return blend(values[before], values[after], (time - times[before]) / (times[after] - times[before]))
        return None

    def translation(self, name, time):
        node = self.node(name)
        value = self.animated(node, "translation", time)
        return value if value is not None else tuple(self.json["nodes"][node].get("translation", (0, 0, 0)))

    def cloth_points(self, node, time):
        primitive = self.json["meshes"][self.json["nodes"][node]["mesh"]]["primitives"][0]
        points = [list(p) for p in self.accessor(primitive["attributes"]["POSITION"])]
        weights = self.animated(node, "weights", time) or ()
        for weight, target in zip(weights, primitive.get("targets", [])):
            if weight != 0:
                for point, move in zip(points, self.accessor(target["POSITION"])):
                    for k in range(3):
                        point[k] += weight * move[k]
        return points


def read_ply(path):
    """Vertices as dicts of lists by property, and triangles."""
    data = open(path, "rb").read()
    header, body = data.split(b"end_header\n", 1)
    lines = header.decode().split("\n")
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    codes = {"float": "f", "uchar": "B", "uint": "I"}
    properties = [line.split()[1:] for line in lines if line.startswith("property") and "list" not in line]
    layout = struct.Struct("<" + "".join(codes[kind] for kind, _ in properties))
    end = counts["vertex"] * layout.size
    rows = list(layout.iter_unpack(body[:end]))
    vertices = {name: [row[i] for row in rows] for i, (_, name) in enumerate(properties)}
    faces = list(struct.iter_unpack("<B3I", body[end:]))
    assert len(faces) == counts["face"] and all(face[0] == 3 for face in faces)
    return vertices, [face[1:] for face in faces]
