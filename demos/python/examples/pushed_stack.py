#!/usr/bin/env python3
"""A stack of boxes that is pushed at its foot: how hard a push does it take?

    PYTHONPATH=build/python python3 demos/python/examples/pushed_stack.py
"""

import numpy as np

import offstage


class PushedStack:
    """A stack of boxes on the ground. The action is the change of the velocity of a box along X by a push [m/s]."""

    def __init__(self, boxes=5, size=0.2):
        self.boxes, self.size = boxes, size

    def reset(self):
        self.world = offstage.World()
        self.world.add_body(offstage.Plane(), name="ground", motion="static", friction=0.6)
        self.bodies = [
            self.world.add_body(offstage.Box([self.size] * 3), name=f"box_{i}", position=[0, self.size * (i + 0.5), 0],
                                friction=0.5, restitution=0.0) for i in range(self.boxes)
        ]
        for _ in range(10):
            self.world.step(1 / 60)
        return self.observation(), {}

    def observation(self):
        """Returns (boxes, 13): position, orientation [w, x, y, z], velocity and angular velocity of each box."""
        return self.world.bodies(self.bodies)

    def step(self, box, speed):
        state = self.world.body(self.bodies[box])
        self.world.set_velocity(self.bodies[box], state["velocity"] + [speed, 0, 0], state["angular_velocity"])
        for _ in range(90):
            self.world.step(1 / 60)
        observation = self.observation()
        top = observation[:, 1].max()
        fell = top < self.size * (self.boxes - 0.5) - 0.5 * self.size
        return observation, -float(fell), bool(fell), False, {"top": top}


def smallest_push(box, steps=8):
    """Returns the smallest change of velocity that makes the stack fall [m/s], by bisection."""
    low, high = 0.0, 8.0
    for _ in range(steps):
        middle = (low + high) / 2
        env = PushedStack()
        env.reset()
        fell = env.step(box, middle)[2]
        low, high = (low, middle) if fell else (middle, high)
    return high


if __name__ == "__main__":
    for box in range(5):
        print(f"box {box}: {smallest_push(box):.2f} m/s")
