#!/usr/bin/env python3
"""Makes the pictures of the gallery's sprites, textures and skies in pictures/. Run it by hand:
python3 assets/make_pictures.py. It needs nothing but Python 3."""

import math
import pathlib
import struct
import zlib

from modelling import add, dot, fractal_noise, mul, smoothstep, unit

PICTURES = pathlib.Path(__file__).resolve().parent / "pictures"
SAMPLES = 3  # per side of a pixel


def write_png(path, width, height, pixel):
    """Writes RGBA; `pixel` maps the position of a sample in pixels to (r, g, b, coverage) in [0, 1], sRGB."""
    rows = bytearray()
    for y in range(height):
        rows.append(0)
        for x in range(width):
            total = [0.0] * 4
            for k in range(SAMPLES * SAMPLES):
                r, g, b, a = pixel(x + (k % SAMPLES + 0.5) / SAMPLES, y + (k // SAMPLES + 0.5) / SAMPLES)
                total = [total[0] + r * a, total[1] + g * a, total[2] + b * a, total[3] + a]
            alpha = total[3] / SAMPLES**2
            color = [c / total[3] if total[3] > 0 else 0 for c in total[:3]]
            rows += bytes(round(255 * min(max(c, 0), 1)) for c in (*color, alpha))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(rows), 9)) +
                     chunk(b"IEND", b""))


def leaf(x, y, size):
    """A pointed leaf with its stem, upright."""
    u, v = 2 * x / size - 1, 1 - 2 * y / size
    stem = abs(u - 0.05 * math.sin(4 * v)) < 0.025 and -0.95 < v < 0.75
    half = 0.55 * math.cos(math.pi / 2 * (v - 0.05) / 0.85)**0.8 if abs(v - 0.05) < 0.85 else 0
    half *= 1 + 0.08 * math.sin(26 * v)
    inside = abs(u) < half
    if not (stem or inside):
        return 0, 0, 0, 0
    vein = stem or abs((v - 0.6 * abs(u)) * 6 % 1 - 0.5) < 0.06
    shade = 0.62 if vein else 0.85 + 0.15 * (1 - abs(u) / max(half, 1e-3))
    return shade, 0.97 * shade, 0.9 * shade, 1


def butterfly(x, y, size, phase):
    """A butterfly from above; `phase` in [0, 1): the beat of its wings."""
    u, v = 2 * x / size - 1, 1 - 2 * y / size
    if abs(u) < 0.045 and -0.5 < v < 0.45:
        return 0.12, 0.1, 0.1, 1
    open_share = 0.25 + 0.75 * (0.5 + 0.5 * math.cos(2 * math.pi * phase))
    s = abs(u) / open_share
    for cx, cy, rx, ry, lean in ((0.47, 0.32, 0.48, 0.36, 0.35), (0.38, -0.36, 0.36, 0.32, -0.3)):
        dx, dy = s - cx, v - cy - lean * (s - cx)
        d = math.hypot(dx / rx, dy / ry)
        if d < 1 and s < 1:
            spot = math.hypot(s - cx - 0.12, v - cy - 0.06) < 0.09
            edge = d > 0.82
            return (0.16, 0.12, 0.12, 1) if edge else (1, 0.95, 0.8, 1) if spot else (0.95, 0.55, 0.12, 1)
    return 0, 0, 0, 0


def write_hdr(path, width, height, radiance):
    """Writes Radiance RGBE with run lengths; `radiance` maps a unit direction to linear (r, g, b). The centre of the
    picture is at -z, its right half at +x."""

    def texel(x, y):
        angle, polar = 2 * math.pi * ((x + 0.5) / width - 0.5), math.pi * (y + 0.5) / height
        color = radiance((math.sin(polar) * math.sin(angle), math.cos(polar), -math.sin(polar) * math.cos(angle)))
        largest = max(color)
        if largest < 1e-32:
            return 0, 0, 0, 0
        exponent = math.frexp(largest)[1]
        return (*(min(int(c * 2.0**(8 - exponent)), 255) for c in color), exponent + 128)

    def runs(values):
        out, k = bytearray(), 0
        while k < len(values):
            run = 1
            while k + run < len(values) and run < 127 and values[k + run] == values[k]:
                run += 1
            if run >= 3:
                out += bytes((128 + run, values[k]))
                k += run
                continue
            start = k
            while k < len(values) and k - start < 128 and values[k:k + 3] != values[k:k + 1] * 3:
                k += 1
            out += bytes((k - start,)) + bytes(values[start:k])
        return out

    data = bytearray(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode())
    for y in range(height):
        row = [texel(x, y) for x in range(width)]
        data += bytes((2, 2, width >> 8, width & 255))
        for channel in range(4):
            data += runs([value[channel] for value in row])
    path.write_bytes(data)


EVENING_SUN = unit((-0.62, 0.3, -0.72))


def evening(d):
    """A low sun between clouds, over dark hills."""
    towards = max(dot(d, EVENING_SUN), 0)
    height = max(d[1], 0)
    low = (1 - height)**5
    color = mul((0.16, 0.30, 0.62), 1 - low)
    color = add(color, mul((0.95, 0.62, 0.42), low * (0.35 + 0.65 * towards**2)))
    color = add(color, mul((1.6, 0.85, 0.35), 0.5 * towards**12 + 2.0 * towards**120))
    if d[1] > 0.01:
        p = (2.2 * d[0] / (d[1] + 0.25), 5.0 * d[1], 2.2 * d[2] / (d[1] + 0.25))
        thick = max(fractal_noise(p, 4, 11) - 0.12, 0)
        cover = (1 - math.exp(-4 * thick)) * smoothstep(0.01, 0.16, d[1])
        rim = math.exp(-5 * thick)
        cloud = add(mul((0.30, 0.27, 0.34), 1), mul((1.5, 0.85, 0.5), rim * (0.12 + 0.9 * towards**3)))
        color = add(mul(color, 1 - cover), mul(cloud, cover))
    hill = 0.05 + 0.035 * fractal_noise((3 * d[0] / math.hypot(d[0], d[2], 1e-6), 0, 3 * d[2] / math.hypot(d[0], d[2], 1e-6)), 4, 5)
    land = smoothstep(hill + 0.004, hill - 0.004, d[1]) if d[1] < 0.12 else 0
    ground = mul((0.055, 0.06, 0.035), 0.6 + 0.9 * towards)
    color = add(mul(color, 1 - land), mul(ground, land))
    if towards > math.cos(math.radians(1.0)):
        color = add(color, (7000.0, 4700.0, 2600.0))
    return color


def slate(x, y, size):
    """Worn stone that repeats at its edges."""
    u, v = 2 * math.pi * x / size, 2 * math.pi * y / size
    p = (0.9 * math.cos(u), 0.9 * math.sin(u), 0.9 * math.cos(v))
    q = (0.9 * math.sin(v), 0, 0)
    grain = fractal_noise(add(p, mul((q[0], q[0], -q[0]), 1.0)), 5, 3)
    vein = abs(fractal_noise(add(mul(p, 0.8), mul((q[0], -q[0], q[0]), 0.8)), 3, 9))
    shade = 0.52 + 0.16 * grain - (0.18 if vein < 0.03 else 0)
    return shade * 1.02, shade, shade * 0.95, 1


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    write_png(PICTURES / "leaf.png", 64, 64, lambda x, y: leaf(x, y, 64))
    write_png(PICTURES / "butterfly_4x2.png", 256, 128,
              lambda x, y: butterfly(x % 64, y % 64, 64, (int(x // 64) + 4 * int(y // 64)) / 8))
    write_png(PICTURES / "slate.png", 128, 128, lambda x, y: slate(x, y, 128))
    write_hdr(PICTURES / "evening.hdr", 320, 160, evening)
