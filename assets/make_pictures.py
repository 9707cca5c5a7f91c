#!/usr/bin/env python3
"""Makes the pictures of the gallery's sprites in pictures/. Run it by hand: python3 assets/make_pictures.py. It needs
nothing but Python 3."""

import math
import pathlib
import struct
import zlib

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


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    write_png(PICTURES / "leaf.png", 64, 64, lambda x, y: leaf(x, y, 64))
    write_png(PICTURES / "butterfly_4x2.png", 256, 128,
              lambda x, y: butterfly(x % 64, y % 64, 64, (int(x // 64) + 4 * int(y // 64)) / 8))
