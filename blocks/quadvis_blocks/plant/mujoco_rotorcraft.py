"""The four-rotor craft as a model of the physics engine MuJoCo."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block import Block, In, Out, Param, ParameterError, State
from quadvis.errors import QuadvisError
from quadvis.machine.inputs import read_input
from quadvis_blocks._craft import DRAG

CAPACITY = 256  # numbers of a model's state
ROTORS = ("front", "right", "rear", "left")
TURNED = np.array((1.0, -1.0, -1.0))  # from MuJoCo's axes, y left and z up, to y right and z down
RAISED = np.array((1.0, -1.0, 1.0))  # to y right and h up


class MujocoRotorcraft(Block, numeric=False):
    """A four-rotor craft that MuJoCo simulates, from a model in MuJoCo's format MJCF.

    The ports are those of ``plant.rotorcraft``, with the same axes and signs: x forward, y right, h up;
    roll > 0 right side down, pitch > 0 nose up, yaw > 0 clockwise from above. The model says all about the
    craft and its world: masses, rotors, lags, limits, gravity, floor, contacts. It must have one body with a
    free joint (of several, the first is the craft) and actuators called ``front``,
    ``right``, ``rear`` and ``left`` that take thrusts (N). Only the drag of the air is the block's: a force
    on the craft's centre of mass, ``drag`` times the speed of the air against the craft.

    The block holds thrusts and wind over a period, which is a whole number of the model's time steps. A run
    starts in a trimmed hover: the activations of the four actuators, where they have any, carry a quarter of
    the weight each. Files that the model includes, such as meshes, are read but not watched for changes.
    Errors: ParameterError if the package ``mujoco`` is not installed (``pip install 'quadvis[mujoco]'``), or
    if MuJoCo refuses the model.

    Source: E. Todorov, T. Erez, Y. Tassa, MuJoCo: A physics engine for model-based control, IROS 2012.
    """

    model = Param(type="file", shown=True, doc="model of the craft and its world (MJCF)")
    drag = Param(
        DRAG, unit="N*s/m", min=0.0, tune=True, doc="drag force divided by the speed through the air"
    )
    initial_position = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m", doc="x, y, h at the start")
    initial_velocity = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m/s", doc="velocity at the start")
    initial_attitude = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="rad", doc="roll, pitch, yaw at the start"
    )
    thrust = In("float64[4]", unit="N", doc="commanded thrust of each rotor: front, right, rear, left")
    wind = In("float64[3]", unit="m/s", default=(0.0, 0.0, 0.0), doc="velocity of the air along x, y, h")
    position = Out("float64[3]", unit="m", doc="x, y, h")
    velocity = Out("float64[3]", unit="m/s", doc="rate of change of the position")
    attitude = Out("float64[3]", unit="rad", doc="roll, pitch, yaw; yaw in (-pi, pi]")
    rates = Out("float64[3]", unit="rad/s", doc="about roll, pitch and yaw axis, as a gyro measures them")

    state = State(f"float64[{CAPACITY}]", doc="MuJoCo's state: time, positions, velocities, activations ...")

    example = """
        craft:
          block: plant.mujoco_rotorcraft
          rate: fast
          with: {model: "quadvis:models/rotorcraft.xml", initial_position: {value: [0, 0, 1.5], unit: m}}
          in: {thrust: {value: [1.3, 1.2, 1.2, 1.2], unit: N}}
    """

    def check(self) -> None:
        """Refuse what MuJoCo refuses, a model of no such craft, and a period that its steps do not fill."""
        simulation = self._simulation()
        step = simulation.step
        if abs(simulation.steps(self.period) * step - self.period) > 1e-9 * self.period:
            problem = (
                f"the model's time step, {step:g} s, does not divide the block's period, {self.period:g} s"
            )
            raise ParameterError("model", f"{problem}; change one of them")

    def _simulation(self) -> _Simulation:
        return self.read_file("model", _Simulation)

    def start(self) -> None:
        """Begin in a trimmed hover at the initial position, velocity and attitude."""
        start = self._simulation().hover(self.initial_position, self.initial_velocity, self.initial_attitude)
        self.state[: len(start)] = start

    def output(self) -> tuple[Any, Any, Any, Any]:
        """Return position, velocity, attitude and rates."""
        return self._simulation().motion(self.state)

    def update(self, thrust: Any, wind: Any) -> None:
        """Let MuJoCo go on for a period."""
        found = self._simulation().advanced(self.state, thrust, RAISED * wind, self.drag, self.period)
        self.state[: len(found)] = found


class _Simulation:
    """MuJoCo's model and memory. Every method begins by setting the state, so nothing is kept between two."""

    def __init__(self, path: str) -> None:
        try:
            import mujoco
        except ImportError as error:
            remedy = "install it with pip install 'quadvis[mujoco]'"
            raise ParameterError("model", f"the package mujoco cannot be loaded: {error}; {remedy}") from None
        self.mujoco = mujoco
        read_input(path)  # so that its contents are known, and a missing file has a plain sentence
        try:
            self.model = mujoco.MjModel.from_xml_path(path)
        except ValueError as error:
            raise QuadvisError(f"MuJoCo refuses '{path}': {' '.join(str(error).split())}") from None
        self.data, self.step = mujoco.MjData(self.model), float(self.model.opt.timestep)
        free = [
            joint
            for joint in range(self.model.njnt)
            if self.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        ]
        if not free:
            raise QuadvisError(f"the model '{path}' has no free joint; add <freejoint/> to the craft's body")
        self.body = int(self.model.jnt_bodyid[free[0]])
        self.place, self.speed = int(self.model.jnt_qposadr[free[0]]), int(self.model.jnt_dofadr[free[0]])
        self.rotors = [self._actuator(name, path) for name in ROTORS]
        # The warm start is not physics, but without it contacts would not repeat to the bit.
        self.kept = int(mujoco.mjtState.mjSTATE_FULLPHYSICS) | int(mujoco.mjtState.mjSTATE_WARMSTART)
        self.size = mujoco.mj_stateSize(self.model, self.kept)
        if self.size > CAPACITY:
            raise QuadvisError(f"the state of '{path}' has {self.size} numbers, {CAPACITY} are the most")

    def _actuator(self, name: str, path: str) -> int:
        found: int = self.mujoco.mj_name2id(self.model, self.mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        if found < 0:
            raise QuadvisError(f"the model '{path}' has no actuator '{name}'; it needs {', '.join(ROTORS)}")
        return found

    def steps(self, period: float) -> int:
        """Return the number of time steps that fill a period (s) best; 0 for a period that is not known."""
        return 0 if math.isnan(period) else max(1, round(period / self.step))

    def hover(self, position: Any, velocity: Any, attitude: Any) -> NDArray[np.float64]:
        """Return the state of a trimmed hover."""
        data, model = self.data, self.model
        self.mujoco.mj_resetData(model, data)
        data.qpos[self.place : self.place + 3] = RAISED * position
        data.qpos[self.place + 3 : self.place + 7] = _quaternion(*attitude)
        data.qvel[self.speed : self.speed + 3] = RAISED * velocity
        weight = -model.opt.gravity[2] * model.body_subtreemass[self.body]
        for rotor in self.rotors:
            if model.actuator_actnum[rotor]:
                data.act[model.actuator_actadr[rotor]] = 0.25 * weight
        return self._state()

    def motion(self, state: NDArray[np.float64]) -> tuple[Any, Any, Any, Any]:
        """Return position, velocity, attitude and rates, in the axes of the block."""
        self._set(state)
        place, speed = self.data.qpos[self.place :], self.data.qvel[self.speed :]
        return RAISED * place[:3], RAISED * speed[:3], _angles(place[3:7]), TURNED * speed[3:6]

    def advanced(
        self, state: NDArray[np.float64], thrust: Any, wind: Any, drag: float, period: float
    ) -> NDArray[np.float64]:
        """Return the state a period (s) later; ``wind`` is in MuJoCo's axes."""
        self._set(state)
        data = self.data
        data.ctrl[self.rotors] = thrust
        for _ in range(self.steps(period)):
            data.xfrc_applied[self.body, :3] = drag * (wind - data.qvel[self.speed : self.speed + 3])
            self.mujoco.mj_step(self.model, data)
        return self._state()

    def _set(self, state: NDArray[np.float64]) -> None:
        self.mujoco.mj_setState(self.model, self.data, state[: self.size], self.kept)

    def _state(self) -> NDArray[np.float64]:
        found = np.empty(self.size)
        self.mujoco.mj_getState(self.model, self.data, found, self.kept)
        return found


def _quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion (w, x, y, z) of 3-2-1 angles in MuJoCo's axes: y and z are turned round."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        -(cr * sp * cy + sr * cp * sy),
        -(cr * cp * sy - sr * sp * cy),
    )


def _angles(quaternion: Any) -> NDArray[np.float64]:
    """Return roll, pitch and yaw of a unit quaternion in MuJoCo's axes."""
    w, x, y, z = (float(part) for part in quaternion)
    y, z = -y, -z
    return np.array((
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
        math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    ))  # fmt: skip
