"""The running PyBullet world of one twin."""

from __future__ import annotations

import math
import tempfile
from contextlib import ExitStack

import numpy as np

from hardware.spec import RobotSpec
from hardware.urdf import WHEELS, urdf
from sim import bodies
from sim.bullet import pybullet
from sim.drive import AT_REST, TORQUE, Drive, Pair, Wheels
from sim.drive_errors import DriveErrors
from sim.errors import PhysicsError
from sim.living import TICK_STEPS, Living
from sim.motion import STEP, Motion
from slam.se3 import SE3
from worlds.world import World

GRAVITY = 9.81
SOLVER_ITERATIONS = 30
"""Wheel odometry of a faultless body is right to 1e-4 of the way, as with PyBullet's 50; at 10 the wheels slip by 0.2 %."""

BUMPED_INTO = 0.25
"""Parts of people and doors that come lower are in the robot's way [m]: feet and shanks."""
SETTLING_STEPS = 50
"""Before time zero: the robot sits down on its wheels, that are not equally large."""


class Physics:
    """World and robot in a PyBullet client of their own; every step leaves a row in `motion`.

    A reset is a new client: rebuilding is deterministic and leaves no memory behind, `resetSimulation` leaves 14 kB a time.
    """

    def __init__(self, world: World, spec: RobotSpec, living: Living, errors: DriveErrors) -> None:
        with ExitStack() as held:
            self.client: int = pybullet.connect(pybullet.DIRECT)
            if self.client < 0:
                raise PhysicsError("PyBullet gives no more physics clients; close some robots first")
            held.callback(pybullet.disconnect, self.client)
            self._prepare()
            self._movable = bodies.add_world(world, self.client)
            self._living = living
            self._moved = [(k, bodies.add_moved(living.parts[k].triangles, self.client)) for k in living.parts_between(0.0, BUMPED_INTO)]
            self._move()
            self._robot = self._load(urdf(spec), world.start)
            self._wheels = self._prepare_robot(errors)
            for _ in range(SETTLING_STEPS):
                pybullet.stepSimulation(self.client)
            self.motion = Motion(len(self._movable), self._inertial_to_base())
            self.motion.append([self._row(None)])
            self._touches, self.collisions = False, 0
            held.pop_all()
        self._open = True

    def close(self) -> None:
        """Let go of the client; `motion` stays."""
        if self._open:
            self._open = False
            pybullet.disconnect(self.client)

    def advance(self, steps: int, motors: Drive) -> None:
        """Let `steps` physics steps pass."""
        if self._moved and (self.motion.steps - 1) % TICK_STEPS == 0:
            self._move()
        rows: list[tuple[float, ...]] = []
        for _ in range(steps):
            if motors.tick(self._turning):
                self._set_motors(motors.rates, motors.torques)
            pybullet.stepSimulation(self.client)
            rows.append(self._row(motors.encoders))
            touches = any(
                contact[9] > 0.0 for contact in pybullet.getContactPoints(bodyA=self._robot, linkIndexA=-1, physicsClientId=self.client)
            )
            self.collisions += touches and not self._touches
            self._touches = touches
        self.motion.append(rows)

    def _move(self) -> None:
        """Put people and doors where they are when their tick begins."""
        frames = self._living.frames(self._living.now, self._living.now).values[:, 0].tolist()
        for part, body in self._moved:
            bodies.move(body, frames[part], self.client)

    def _row(self, encoders: Pair | None) -> tuple[float, ...]:
        p, q = pybullet.getBasePositionAndOrientation(self._robot, self.client)
        left, right = pybullet.getJointStates(self._robot, self._wheels, self.client)
        self._turning = Wheels((left[0], right[0]), (left[1], right[1]), (left[3], right[3]))
        row = (*p, *q, *(encoders or self._turning.angles))
        for body in self._movable:
            p, q = pybullet.getBasePositionAndOrientation(body, self.client)
            row = (*row, *p, *q)
        return row

    def _set_motors(self, rates: Pair, torques: Pair) -> None:
        pybullet.setJointMotorControlArray(
            self._robot,
            self._wheels,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=rates,
            forces=torques,
            physicsClientId=self.client,
        )

    def _prepare(self) -> None:
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=self.client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP,
            numSolverIterations=SOLVER_ITERATIONS,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )
        bodies.add_floor(self.client)

    def _load(self, text: str, start: tuple[float, float, float]) -> int:
        x, y, yaw = start
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(text)
            file.flush()
            try:
                return pybullet.loadURDF(
                    file.name,
                    basePosition=(x, y, 0.0),
                    baseOrientation=(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)),
                    flags=pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_IGNORE_VISUAL_SHAPES,
                    physicsClientId=self.client,
                )
            except pybullet.error as error:
                raise PhysicsError(f"PyBullet cannot load the robot's URDF: {error}") from error

    def _prepare_robot(self, errors: DriveErrors) -> tuple[int, int]:
        """Set groups, friction, damping and motors; returns the wheel joints (left, right)."""
        links = {"base": -1}
        for joint in range(pybullet.getNumJoints(self._robot, physicsClientId=self.client)):
            links[pybullet.getJointInfo(self._robot, joint, physicsClientId=self.client)[12].decode()] = joint
        for name, link in links.items():
            group = bodies.ROLLING if name in (*WHEELS, "caster") else bodies.HULL
            bodies.set_group(self._robot, link, group, self.client)
            pybullet.changeDynamics(self._robot, link, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0, physicsClientId=self.client)
        pybullet.changeDynamics(self._robot, links["caster"], lateralFriction=errors.caster_friction, physicsClientId=self.client)
        self._wheels = links[WHEELS[0]], links[WHEELS[1]]
        for wheel in self._wheels:
            pybullet.changeDynamics(self._robot, wheel, lateralFriction=errors.wheel_friction, physicsClientId=self.client)
        self._set_motors(AT_REST, (TORQUE, TORQUE))
        return self._wheels

    def _inertial_to_base(self) -> SE3:
        t, q = pybullet.getDynamicsInfo(self._robot, -1, physicsClientId=self.client)[3:5]
        return SE3.from_quaternion(np.array(q), np.array(t)).inverse()
