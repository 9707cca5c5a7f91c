"""Scenes, simulations and films from Python agree with those of the program."""

import json
import struct
import threading

import numpy as np
import pytest

import offstage


def test_state_hash_is_that_of_the_program(tiny, program):
    wanted = json.loads(program("simulate", tiny, "-q"))["state_hash"]
    simulation = offstage.Simulation(offstage.load(tiny.as_posix()))
    while simulation.frame < 12:
        simulation.advance()
    assert simulation.state_hash == wanted
    *_, last = offstage.render(tiny, images=False)
    assert last.snapshot.state_hash == wanted and last.number == 12


def test_pixels_and_channels_are_those_of_the_program(tiny, program, tmp_path):
    program("render", tiny, "-o", tmp_path / "f/####.png", "--frames", "4-5", "--channels", "depth", "--channel-format", "png", "-q")
    frames = list(offstage.render(tiny, "4-5", channels=True))
    assert [f.number for f in frames] == [4, 5]
    from_file = read_png(tmp_path / "f/0005.png")
    assert np.array_equal(frames[1].image[:, :, :3], from_file[:, :, :3])
    frame = frames[1]
    assert frame.image.shape == (54, 96, 4) and frame.depth.shape == (54, 96) and frame.normal.shape == (54, 96, 3)
    surface = np.isfinite(frame.depth)
    assert surface[frame.id > 0].all() and (frame.id > 0).mean() > 0.3  # springs have no number
    assert np.allclose(np.linalg.norm(frame.normal[surface], axis=1), 1, atol=1e-3)
    assert frame.motion.shape == (54, 96, 2) and np.abs(frame.motion).max() > 0


def read_png(path):
    """Pixels of a PNG, by matplotlib's reader."""
    from matplotlib import image
    return np.rint(image.imread(path) * 255).astype(np.uint8)


def test_errors_have_file_line_path_and_suggestion(tmp_path):
    bad = tmp_path / "bad.json"
    bad.write_text('{"version": 1,\n "bodies": [{"shape": {"type": "sphere"},\n  "velocty": [0, 1, 0]}]}')
    with pytest.raises(offstage.SceneError) as error:
        offstage.load(str(bad))
    problem, = error.value.problems
    assert problem.file.endswith("bad.json") and problem.line == 3 and problem.path == "/bodies/0/velocty"
    assert "did you mean 'velocity'" in problem.what
    with pytest.raises(offstage.SceneError) as error:
        offstage.scene({"version": 1, "world": {"step": -1}})
    assert error.value.problems[0].path == "/world/step" and isinstance(error.value, ValueError)


def test_a_dict_is_a_scene(tiny):
    scene = offstage.scene({"version": 1, "bodies": [{"name": "ball", "shape": {"type": "sphere"}, "position": [0, 5, 0]}],
                            "output": {"fps": 10, "duration": 1}}, set={"world.gravity": [0, -2, 0]})
    assert scene.frame_count == 10 and scene.fps == 10 and scene.moving_bodies == ["ball"]
    heights = [f.snapshot.positions[0, 1] for f in offstage.render(scene, images=False)]
    assert np.allclose(heights, [5 - 0.01 * k * k for k in range(10)], atol=1e-6)
    assert scene.to_dict()["world"]["gravity"] == [0, -2, 0]


def test_snapshots_are_views_that_outlive_the_film(tiny):
    snapshot = [f.snapshot for f in offstage.render(tiny, "12", images=False)][0]
    scene = offstage.load(str(tiny))
    points = snapshot.point_sets[scene.point_sets.index("fountain")]
    positions, ids = points["position"], points["id"]
    assert not positions.flags.owndata and not positions.flags.writeable and positions.dtype == np.float32
    before = positions.copy()
    del snapshot, points
    assert np.array_equal(positions, before) and np.all(np.diff(ids.astype(np.int64)) > 0)


def test_a_film_can_be_cancelled_and_reports_progress(tiny):
    seen = []
    film = offstage.render(tiny, images=False)
    assert len(film) == 12
    for frame in film:
        seen.append((frame.number, film.done))
        if frame.number == 3:
            film.cancel()
    assert seen == [(1, 1), (2, 2), (3, 3)]
    progress = []
    list(offstage.render(tiny, "1-4", images=False, progress=lambda done, total: progress.append((done, total))))
    assert progress == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_films_run_in_several_threads(tiny):
    hashes = {}

    def run(key):
        hashes[key] = [f.snapshot.state_hash for f in offstage.render(tiny, "1-6", images=key == 0)]

    threads = [threading.Thread(target=run, args=(key,)) for key in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert hashes[0] == hashes[1] == hashes[2] and len(set(hashes[0])) == 6


def test_an_error_in_a_film_reaches_the_consumer(tiny, tmp_path):
    with pytest.raises(OSError, match="no cache"):
        list(offstage.render(tiny, cache=tmp_path))
    with pytest.raises(ValueError, match="13"):
        offstage.render(tiny, "13")


def test_a_cache_is_read_and_described_truly(tiny, program, tmp_path):
    program("simulate", tiny, "--cache", tmp_path / "cache", "-q")
    cache = offstage.Cache(tmp_path / "cache")
    film = [f.snapshot for f in offstage.render(tiny, images=False)]
    assert len(cache) == 12 and [s.state_hash for s in cache] == [s.state_hash for s in film]
    assert np.array_equal(cache[7].positions, film[6].positions)
    assert cache.key == offstage.load(str(tiny)).simulation_key
    cached = [f.snapshot.state_hash for f in offstage.render(tiny, cache=tmp_path / "cache", images=False)]
    assert cached == [s.state_hash for s in film]
    # The header of docs/cache.md.
    file = next((tmp_path / "cache").glob("generation-*/000007.snap"))
    magic, version, zero, size = struct.unpack_from("<8sIIQ", file.read_bytes())
    assert (magic, version, zero) == (b"offsnap\0", 6, 0) and size > 100
    with pytest.raises(IndexError):
        cache[13]
    with pytest.raises(offstage.FileError):
        offstage.Cache(tmp_path)
