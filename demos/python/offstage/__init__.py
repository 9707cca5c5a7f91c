"""Physically simulated films of scenes: bodies, joints, particles and cloth; deterministic, without a display or a GPU.

    import offstage

    for frame in offstage.render("rain.json", frames="1-30"):
        print(frame.number, frame.image.shape, frame.snapshot.state_hash)

Units are metres, kilograms, seconds and radians; Y is up; quaternions are [w, x, y, z]. See docs/python.md.
"""

import collections.abc as _abc
import json as _json
import os as _os

# Presets and models that were installed with the package.
_data = _os.path.join(_os.path.dirname(__file__), "data")
if _os.path.isdir(_data):
    _os.environ.setdefault("OFFSTAGE_DATA", _data)

from ._offstage import (  # noqa: E402, F401
    BodyHandle, Box, Capsule, ClothHandle, Cone, Cylinder, DivergedError, Ellipsoid, FileError, Film, ForceHandle, Frame,
    Frustum, Instance, JointHandle, Material, MeshShape, ParticleSystemHandle, Plane, Points, Problem, Scene, SceneError, Simulation, Snapshot,
    Sphere, SpringHandle, Stage, UnavailableError, World, __version__, parse_frames, step_all)
from . import _offstage  # noqa: E402


def load(file, set=None, allow=()):
    """Returns the Scene in a file.

    `set` overrides values by their paths: {"emitters.0.rate": 200}. `allow`: folders, besides the scene's own, from which it
    may read files. Raises SceneError, whose `problems` have file, line, column, path and what.
    """
    return _offstage.load(_os.fspath(file), set or {}, list(allow))


def scene(source, set=None, folder=".", name="scene", allow=()):
    """Returns a Scene from a file or a dict. Returns a Scene unchanged.

    `set` overrides values by their paths: {"emitters.0.rate": 200}. Files that a dict names are relative to `folder`;
    `name` stands for the file in messages. Raises SceneError, whose `problems` have file, line, column, path and what.
    """
    if isinstance(source, Scene):
        if set:
            raise ValueError("set: give overrides when the scene is loaded")
        return source
    if isinstance(source, _abc.Mapping):
        return _offstage._parse(_json.dumps(source, indent=2), name, _os.fspath(folder), set or {}, list(allow))
    return load(source, set, allow)


def render(source, frames="", *, images=True, channels=False, cache=None, set=None, threads=0, gl="", progress=None):
    """Iterates over the frames of a film. A separate thread renders a few frames in advance.

    source    scene: a file, a dict or a Scene
    frames    "1-30,40,50-90x2"; negative numbers count from the end; empty: all
    images    whether frames have pictures; False: only states, and channels if requested
    channels  whether frames have the channels depth, normal, id and motion
    cache     folder that `offstage simulate --cache` wrote; states are read from it instead of simulating
    threads   number of threads that draw; 0: all. Only the first call in a process has an effect
    gl        "osmesa", "egl" or "egl:gpu". Only the first call in a process has an effect
    progress  called as progress(done, total) for each frame

    The pixels and states are the same as those of the command line. `film.cancel()` ends a film.
    """
    film = _offstage._film(scene(source, set), frames, images, channels, None if cache is None else _os.fspath(cache),
                           threads, gl)
    return film if progress is None else _with_progress(film, progress)


def _with_progress(film, progress):
    for frame in film:
        progress(film.done, film.total)
        yield frame


class Cache:
    """A folder of snapshots that `offstage simulate --cache` wrote (docs/cache.md).

        cache = offstage.Cache("cache")
        for snapshot in cache:
            print(snapshot.frame, snapshot.positions)
    """

    def __init__(self, folder):
        self.folder = _os.fspath(folder)
        info = _offstage._cache_info(self.folder)
        if info["problem"]:
            raise FileError(f"{self.folder}: {info['problem']}")
        self.format, self.frames, self.key, self.bytes = info["format"], info["frames"], info["key"], info["bytes"]

    def __len__(self):
        return self.frames

    def __getitem__(self, frame):
        """Returns the Snapshot of a frame; frames are numbered from 1."""
        if not 1 <= frame <= self.frames:
            raise IndexError(f"the cache has frames 1-{self.frames}")
        return _offstage._cache_snapshot(self.folder, frame)

    def __iter__(self):
        return (self[frame] for frame in range(1, self.frames + 1))
