from math import cos, pi, sin

blades, hub, rim, half_blade, half_width = 8, 0.15, 0.5, 0.02, 0.15
outline = []  # counter-clockwise, seen from +z
for k in range(blades):
    turn = 2 * pi * k / blades
    for x, y in [(hub, -half_blade), (rim, -half_blade), (rim, half_blade), (hub, half_blade)]:
        outline.append((x * cos(turn) - y * sin(turn), x * sin(turn) + y * cos(turn)))
n = len(outline)
with open("wheel.obj", "w") as file:
    for z in (half_width, -half_width):
        file.writelines(f"v {x:.6f} {y:.6f} {z}\n" for x, y in outline + [(0, 0)])
    for i in range(n):
        a, b, front, back = i + 1, (i + 1) % n + 1, n + 1, 2 * n + 2
        file.write(f"f {front} {a} {b}\nf {back} {b + n + 1} {a + n + 1}\nf {a} {a + n + 1} {b + n + 1} {b}\n")
