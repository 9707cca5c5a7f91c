#!/usr/bin/env python3
"""Renders a scene, and writes its pictures and depths as numpy files.

    PYTHONPATH=build/python python3 demos/python/examples/film.py demos/scenes/wall.json out 1-10
"""

import pathlib
import sys

import numpy as np

import offstage


def main(scene_file, folder, frames=""):
    out = pathlib.Path(folder)
    out.mkdir(exist_ok=True)
    try:
        scene = offstage.load(scene_file, set={"render.size": [320, 180]})
    except offstage.SceneError as error:
        for problem in error.problems:
            print(f"{problem.file}:{problem.line}: {problem.path}: {problem.what}", file=sys.stderr)
        return 3
    show = lambda done, total: print(f"\r{done} of {total}", end="", file=sys.stderr)
    for frame in offstage.render(scene, frames, channels=True, progress=show):
        np.savez_compressed(out / f"{frame.number:04}.npz", image=frame.image, depth=frame.depth, id=frame.id)
    print(file=sys.stderr)
    return 0


if __name__ == "__main__":
    if not 3 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
