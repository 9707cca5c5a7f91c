#!/usr/bin/env python3
"""Sweeps the rate of an emitter and plots the results with matplotlib.

    PYTHONPATH=build/python python3 demos/python/examples/sweep.py demos/scenes/fountain.json sweep.png
"""

import sys

import numpy as np

import offstage


def figures(scene_file, path, values, duration=1.0):
    """Returns the number of particles and the greatest height [m] at the end, for each value at `path`. Draws nothing."""
    rows = []
    for value in values:
        scene = offstage.load(scene_file, set={path: value, "output.duration": duration})
        *_, last = offstage.render(scene, images=False)
        heights = np.concatenate([points["position"][:, 1] for points in last.snapshot.point_sets])
        rows.append((len(heights), heights.max() if len(heights) else 0.0))
    return np.array(rows)


def main(scene_file, picture, path="emitters.0.rate", values=(1000, 2000, 4000, 8000)):
    rows = figures(scene_file, path, values)
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(8, 3))
    left.plot(values, rows[:, 0], "o-")
    left.set(xlabel=path, ylabel="particles after 1 s")
    right.plot(values, rows[:, 1], "o-")
    right.set(xlabel=path, ylabel="highest particle [m]")
    figure.tight_layout()
    figure.savefig(picture)
    return rows


if __name__ == "__main__":
    if not 3 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
