#!/usr/bin/env python3
"""A cart with a pole as an environment in the style of gymnasium, and many of them at once.

    PYTHONPATH=build/python python3 demos/python/examples/cart_pole.py

The class has the methods of gymnasium.Env (reset, step, render) but needs no gymnasium. A controller with fixed gains keeps the
pole upright.
"""

import math

import numpy as np

import offstage


class CartPole:
    """A pole on a hinge of a cart, which slides on a rail. The action is the force on the cart [N], from -10 to 10."""

    rail, pole_length, dt, force_limit = 2.4, 1.0, 1 / 50, 10.0

    def __init__(self):
        self.world = None

    def reset(self, seed=None):
        rng = np.random.default_rng(seed)
        self.world = offstage.World(max_step=1 / 400)
        angle = rng.uniform(-0.05, 0.05)
        top = np.array([0, self.pole_length, 0])
        self.cart = self.world.add_body(offstage.Box([0.5, 0.2, 0.3]), name="cart", mass=1.0, collides=False)
        half = [math.cos(angle / 2), 0, 0, math.sin(angle / 2)]
        centre = [-math.sin(angle) * top[1] / 2, math.cos(angle) * top[1] / 2, 0]
        self.pole = self.world.add_body(offstage.Capsule(0.03, self.pole_length - 0.06), name="pole", mass=0.1, position=centre,
                                        orientation=half, collides=False)
        self.slide = self.world.add_joint("prismatic", self.cart, axis=[1, 0, 0])
        self.hinge = self.world.add_joint("revolute", self.pole, self.cart, anchor=[0, 0, 0], axis=[0, 0, 1])
        self.start_angle = angle
        self.push = None
        return self.observation(), {}

    def observation(self):
        """Returns (4,): position and speed of the cart [m, m/s], angle from upright and angular speed of the pole [rad, rad/s]."""
        slide, hinge = self.world.joint(self.slide), self.world.joint(self.hinge)
        return np.array([slide["coordinate"], slide["speed"], self.start_angle + hinge["coordinate"], hinge["speed"]])

    def apply(self, force):
        """Sets the force on the cart for the next steps."""
        if self.push is not None:
            self.world.remove(self.push)
        force = float(np.clip(force, -self.force_limit, self.force_limit))
        self.push = self.world.add_force("constant", force=[force, 0, 0], bodies=[self.cart])

    def step(self, action):
        self.apply(action)
        self.world.step(self.dt)
        return self.outcome()

    def outcome(self):
        observation = self.observation()
        terminated = abs(observation[0]) > self.rail or abs(observation[2]) > 0.4
        return observation, 1.0, bool(terminated), False, {}

    def render(self, stage=None):
        """Returns the picture as (height, width, 4) uint8."""
        if stage is None:
            stage = Picture()
        return stage.draw(self.world, {self.cart: "cart", self.pole: "pole"})


class Picture:
    """Draws the two bodies."""

    def __init__(self):
        self.stage = offstage.Stage(320, 180)
        red, grey = self.stage.add_material([0.6, 0.08, 0.05]), self.stage.add_material([0.4, 0.4, 0.42])
        self.parts = {"cart": self.stage.add_shape(offstage.Box([0.5, 0.2, 0.3]), grey, object=1),
                      "pole": self.stage.add_shape(offstage.Capsule(0.03, 0.94), red, object=2)}
        self.stage.set_camera([0, 0.9, 5], [0, 0.4, 0])

    def draw(self, world, bodies):
        for body, part in bodies.items():
            state = world.body(body)
            self.stage.set_pose(self.parts[part], state["position"], state["orientation"])
        return self.stage.image()


def balance(observation):
    """A controller with hand-tuned gains: it drives the cart under the pole, which leans to -X for a positive angle."""
    x, v, angle, rate = observation
    return x + 2 * v - 40 * angle - 10 * rate


def run_one(steps=250, seed=0):
    """Returns the number of steps until the pole has fallen, at most `steps`."""
    env = CartPole()
    observation, _ = env.reset(seed)
    for i in range(steps):
        observation, _, terminated, _, _ = env.step(balance(observation))
        if terminated:
            return i
    return steps


def run_many(count=16, steps=100):
    """Steps many worlds together in several threads, without the interpreter lock."""
    envs = [CartPole() for _ in range(count)]
    observations = [env.reset(seed)[0] for seed, env in enumerate(envs)]
    for _ in range(steps):
        for env, observation in zip(envs, observations):
            env.apply(balance(observation))
        offstage.step_all([env.world for env in envs], CartPole.dt)
        observations = [env.observation() for env in envs]
    return np.array(observations)


if __name__ == "__main__":
    print("one pole stayed upright for", run_one(), "of 250 steps")
    angles = np.abs(run_many()[:, 2])
    print(f"16 poles after 2 s: largest angle {angles.max():.4f} rad")
