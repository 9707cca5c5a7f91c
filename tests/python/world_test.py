"""World on numpy arrays: motions with a closed form, errors as exceptions, many worlds at once."""

import math
import pathlib
import sys
import time

import numpy as np
import pytest

import offstage

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "demos/python/examples"))


def test_a_thrown_ball_follows_its_parabola():
    world = offstage.World(gravity=[0, -9.81, 0])
    ball = world.add_body(offstage.Sphere(0.1), name="ball", position=[0, 10, 0], velocity=[2, 3, 0], mass=2)
    for _ in range(60):
        report = world.step(1 / 60)
    state = world.body(ball)
    assert report["finite"] and world.time == pytest.approx(1)
    assert report["substeps"] == 4 and report["exact_solver_fallbacks"] == 0 and "integration_steps" in report
    assert np.allclose(state["position"], [2, 10 + 3 - 9.81 / 2, 0], atol=1e-9)
    assert world.energy["kinetic"] == pytest.approx(0.5 * 2 * (4 + (3 - 9.81)**2), rel=1e-9)
    assert np.allclose(world.bodies([ball])[0, 7:10], [2, 3 - 9.81, 0])


def test_a_pendulum_swings_with_the_period_of_its_length():
    world = offstage.World(max_step=1 / 960)
    angle, length = 0.01, 0.8
    bob = world.add_body(offstage.Sphere(0.001), position=[length * math.sin(angle), -length * math.cos(angle), 0], mass=1)
    hinge = world.add_joint("revolute", bob, anchor=[0, 0, 0], axis=[0, 0, 1])
    period = 2 * math.pi * math.sqrt(length / 9.81) * (1 + angle**2 / 16)
    world.step(period)
    assert world.joint(hinge)["coordinate"] == pytest.approx(0, abs=1e-6)
    world.step(period / 2)
    assert world.joint(hinge)["coordinate"] == pytest.approx(-2 * angle, rel=1e-4)


def test_particles_are_arrays():
    world = offstage.World()
    system = world.add_particle_system(name="drops", collides=False)
    positions = np.arange(30.0).reshape(10, 3)
    ids = world.add_particles(system, positions, velocities=np.ones((10, 3)), mass=0.1, radius=np.full(10, 0.02), lifespan=0.5)
    assert ids.tolist() == list(range(10))
    world.step(0.25)
    drops = world.particles(system)
    fall = np.array([0.25, 0.25 - 9.81 * 0.25**2 / 2, 0.25])
    assert np.allclose(drops["position"], positions + fall, atol=1e-9)
    assert drops["id"].dtype == np.uint64 and np.allclose(drops["age"], 0.25)
    world.step(0.5)
    assert world.particle_count == 0


def test_a_cloth_hangs_from_its_pins_and_a_mesh_falls():
    world = offstage.World()
    cloth = world.add_grid_cloth([1, 1], [10, 10], fabric="cotton", position=[0, 2, 0], pins=[0, 10])
    corners = np.array([[x, y, z] for x in (-.5, .5) for y in (-.5, .5) for z in (-.5, .5)])
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
             [1, 5, 7], [1, 7, 3]]
    box = world.add_body(world.add_mesh(corners, faces), position=[5, 3, 0], density=500)
    for _ in range(30):
        world.step(1 / 60)
    state = world.cloth(cloth)
    assert state["position"].shape == (121, 3) and state["triangles"].shape == (200, 3)
    assert np.allclose(state["position"][[0, 10]], [[-.5, 2, -.5], [.5, 2, -.5]], atol=1e-9)
    assert state["position"][60, 1] < 1.6
    assert world.body(box)["mass"] == pytest.approx(500) and world.body(box)["position"][1] == pytest.approx(3 - 9.81 / 8)


def test_a_body_can_have_another_centre_and_inertia_than_its_shape():
    world = offstage.World(gravity=[0, 0, 0])
    for inertia in ([0.2, 0.3, 0.4], np.diag([0.2, 0.3, 0.4])):
        body = world.add_body(offstage.Ellipsoid([0.3, 0.2, 0.1]), mass=2, centre=[0, -0.1, 0], inertia=inertia,
                              position=[0, 5, 0], angular_velocity=[0, 0, 1], velocity=[0, 0, 0], collides=False)
        # The frame's origin is 0.1 m above the centre of mass, which does not move: the velocity given is that of the centre.
        world.step(0.1)
        assert world.body(body)["angular_momentum"] == pytest.approx([0, 0, 0.4])
        assert world.body(body)["centre"] == pytest.approx([0, 4.9, 0])
    frustum = world.add_body(offstage.Frustum(0.4, 0.2, 0.3), density=1000)
    assert world.body(frustum)["mass"] == pytest.approx(1000 * np.pi * 0.3 / 3 * (0.4**2 + 0.4 * 0.2 + 0.2**2))
    with pytest.raises(ValueError, match="inertia"):
        world.add_body(offstage.Box(), inertia=[1, 2])
    with pytest.raises(ValueError, match="inertia"):
        world.add_body(offstage.Box(), inertia=[1, 1, 3])


def test_a_cloth_takes_values_instead_of_those_of_its_fabric():
    length, radius = 0.3, 0.06

    def hang(**values):
        world = offstage.World()
        # The first two columns are clamped.
        cloth = world.add_grid_cloth([length, 0.04], [30, 4], pins=[c + 31 * r for r in range(5) for c in range(2)],
                                     self_collision=False, collides=False, bend=1e-6, bend_model="springs", max_stretch=0,
                                     stretch=3000, air_density=40, stretch_damping=0.2, integrator="implicit", **values)
        for _ in range(48):
            world.step(1 / 24)
        return world.cloth(cloth)

    bent, limp = hang(min_bend_radius=radius), hang()
    end = bent["position"].reshape(5, 31, 3)[2]
    assert end[30, 0] - end[1, 0] == pytest.approx(radius, abs=0.008) and bent["max_bend"] < 1.05
    assert limp["position"].reshape(5, 31, 3)[2, 30, 0] - end[1, 0] < radius / 2 and limp["max_bend"] == 0
    world = offstage.World()
    late = world.add_grid_cloth([1, 1], [4, 4], appear_at=0.5, remove_at=1)
    world.step(0.25)
    assert len(world.cloth(late)["position"]) == 25
    with pytest.raises(ValueError, match="min_bend_radius"):
        world.add_grid_cloth([1, 1], [4, 4], min_bend_radius=-1)
    with pytest.raises(ValueError, match="bend_model"):
        world.add_grid_cloth([1, 1], [4, 4], bend_model="hinge")


def test_mistakes_are_exceptions_and_never_crashes():
    world, other = offstage.World(), offstage.World()
    ball = world.add_body(offstage.Sphere(1), position=[0, 5, 0])
    with pytest.raises(TypeError, match="no keyword 'mas'"):
        world.add_body(offstage.Sphere(1), mas=2)
    with pytest.raises(ValueError, match="'static'"):
        world.add_body(offstage.Sphere(1), motion="statc")
    with pytest.raises(ValueError):
        world.add_body(offstage.Sphere(-1))
    with pytest.raises(ValueError, match="shape"):
        world.add_particles(world.add_particle_system(), np.zeros((4, 2)))
    with pytest.raises(ValueError, match="> 0"):
        world.step(0)
    with pytest.raises(ValueError, match="does not belong to this world"):
        other.body(ball)
    joint = world.add_joint("spherical", ball, anchor=[0, 6, 0])
    assert world.remove(ball) and not world.remove(ball)
    for stale in (lambda: world.body(ball), lambda: world.joint(joint), lambda: world.set_velocity(ball, [0, 0, 0])):
        with pytest.raises(ValueError, match="removed"):
            stale()
    with pytest.raises(ValueError):
        world.add_mesh_cloth(np.zeros((3, 3)), [[0, 1, 7]])


def test_the_same_world_has_the_same_hash_and_callbacks_see_sub_steps():
    def run(threads):
        worlds = []
        for k in range(4):
            world = offstage.World()
            world.add_body(offstage.Plane(), motion="static")
            for i in range(6):
                world.add_body(offstage.Box([0.2] * 3), position=[0.01 * k * i, 0.11 + 0.22 * i, 0])
            worlds.append(world)
        for _ in range(30):
            assert all(offstage.step_all(worlds, 1 / 60, threads))
        return [world.state_hash for world in worlds]

    hashes = run(1)
    assert len(set(hashes)) == 4 and run(2) == hashes
    times = []
    world = offstage.World(max_step=0.01)
    world.step(0.05, lambda start, end: times.append((start, end)))
    assert len(times) == 5 and times[-1][1] == pytest.approx(0.05)
    with pytest.raises(ZeroDivisionError):
        world.step(0.05, lambda start, end: 1 / 0)


def test_a_stage_draws_what_it_is_given():
    stage = offstage.Stage(64, 36)
    ball = stage.add_shape(offstage.Sphere(0.5), stage.add_material([0.8, 0, 0]), object=7)
    stage.set_camera([0, 0, 5], [0, 0, 0], fov_deg=30)
    middle = stage.channels()
    assert middle["id"][18, 32] == 7 and middle["depth"][18, 32] == pytest.approx(4.5, abs=6e-3)  # half a pixel aside, in a mesh
    image = stage.image(samples=1)
    assert image.shape == (36, 64, 4) and image[18, 32, 0] > 2 * image[18, 32, 2]
    stage.set_pose(ball, [10, 0, 0])
    assert stage.channels()["id"].max() == 0
    points = stage.add_points()
    stage.set_points(points, [[0, 0, 0]], radius=0.5)
    assert np.isfinite(stage.channels()["depth"][18, 32])
    with pytest.raises(ValueError, match="stage"):
        offstage.Stage(8, 8).set_pose(ball, [0, 0, 0])


def test_the_examples_do_what_they_say(tmp_path, tiny):
    import cart_pole
    import film
    import pushed_stack
    import sweep
    assert cart_pole.run_one(steps=150) == 150
    assert np.abs(cart_pole.run_many(count=4, steps=50)[:, 2]).max() < 0.1
    fallen = cart_pole.CartPole()
    fallen.reset(seed=1)
    assert any(fallen.step(0.0)[2] for _ in range(250)), "without control it falls"

    stack = pushed_stack.PushedStack(boxes=3)
    stack.reset()
    assert not stack.step(0, 0.1)[2]
    stack.reset()
    assert stack.step(0, 6.0)[2]

    rows = sweep.main(tiny, tmp_path / "sweep.png", values=(100, 200), path="emitters.0.rate")
    assert (tmp_path / "sweep.png").stat().st_size > 1000
    assert rows[1, 0] - 1 == pytest.approx(2 * (rows[0, 0] - 1), abs=3), "one ball, and drops by the rate"

    assert film.main(str(tiny), tmp_path / "film", "1-2") == 0
    saved = np.load(tmp_path / "film/0002.npz")
    assert saved["image"].shape == (180, 320, 4) and saved["depth"].dtype == np.float32


def test_balls_roll_and_the_books_algorithms_are_keywords():
    world = offstage.World(narrow_phase="vclip", trees="obb", tree_split="mean", broad_phase="grid", cell_factor=2,
                           impact_time="bisection", mesh_pairs="triangles", particle_contacts="lcp", particle_cluster=8)
    world.add_body(offstage.Plane(), motion="static", friction=0.3, restitution=0)
    balls = world.add_particle_system(rotates=True)
    world.add_particles(balls, [[0, 0.01, 0]], velocities=[[1.4, 0, 0]], mass=0.1, radius=0.01, restitution=0, friction=0.3)
    wheel = world.add_body(offstage.Sphere(0.1), position=(0, 5, 0), mass=2)
    world.add_force("applied", bodies=[wheel], torque=(0, 0.08, 0))
    for _ in range(60):
        world.step(1 / 60)
    state = world.particles(balls)
    assert state["velocity"][0, 0] == pytest.approx(1, abs=2e-3), "5/7 of its speed"
    assert state["angular_velocity"][0, 2] == pytest.approx(-100, abs=0.2)
    assert world.body(wheel)["angular_velocity"][1] == pytest.approx(10, rel=1e-6), "0.08 N m / (0.4 m r^2) * 1 s"
    with pytest.raises(ValueError, match="particle_cluster"):
        offstage.World(particle_cluster=100)
    balloon = world.add_grid_cloth((1, 1), (2, 2))
    assert world.cloth(balloon)["pressure"] == 0
