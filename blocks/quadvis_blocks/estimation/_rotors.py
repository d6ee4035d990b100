"""The model of the rotors with delayed commands, which the estimators share.

A command is a wrench (4,): collective thrust (N), then the torques about roll, pitch and yaw axis over the
inertias (rad/s^2). A command arrives after a delay and holds until the next command arrives. The rotors
follow with a first-order lag. Delay and lag are linear, so they act on a wrench as on the thrust of each
rotor.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import reached

CAPACITY = 128  # commands: the last one that arrived, and the commands on their way


def wrench(thrust: Any, arm: float, inertia: Any, torque_ratio: float) -> Any:
    """Return the wrench of four thrusts (N): front, right, rear, left, by equations (14) to (16)."""
    front, right, rear, left = float(thrust[0]), float(thrust[1]), float(thrust[2]), float(thrust[3])
    return np.array(
        (
            front + right + rear + left,
            arm * (left - right) / float(inertia[0]),
            arm * (front - rear) / float(inertia[1]),
            torque_ratio * (front + rear - right - left) / float(inertia[2]),
        )
    )


def start(times: Any, commands: Any, now: Any, collective: float) -> None:
    """Begin with one command that has arrived: a collective thrust (N) and no torque."""
    times[0] = -math.inf
    for index in range(4):
        commands[0, index] = now[index] = collective if index == 0 else 0.0


def send(times: Any, commands: Any, count: int, time: float, delay: float, command: Any) -> int:
    """Send a command at a time (s), drop the commands that are over, and return the number of kept commands.

    The commands before the last one that arrived are over. Every command is kept, even if it equals the one
    before: the queue must not depend on the values. `check_delay` has made sure that there is room.
    """
    first = 0
    while first + 1 < count and reached(time, times[first + 1]):
        first += 1
    if first > 0:
        count -= first
        times[:count] = times[first : first + count].copy()
        commands[:count] = commands[first : first + count].copy()
    times[count] = time + delay
    commands[count] = command
    return count + 1


def follow(
    times: Any, commands: Any, count: int, now: Any, begin: float, end: float, lag: float, mean: Any
) -> None:
    """Carry the wrench `now` (4,) in place from `begin` to `end` (s), and write its mean into `mean` (4,).

    `times` are the instants at which the commands reach the rotors; the first one is before `begin`.
    """
    for index in range(4):
        mean[index] = 0.0
    at = begin
    place = count - 1
    while place > 0 and not reached(begin, times[place]):
        place -= 1
    while not reached(at, end):
        until = end
        if place + 1 < count and not reached(times[place + 1], end):
            until = float(times[place + 1])
        keep, time = math.exp((at - until) / lag), until - at
        for index in range(4):
            wanted = float(commands[place, index])
            off = float(now[index]) - wanted
            mean[index] += wanted * time + off * lag * (1.0 - keep)
            now[index] = wanted + off * keep
        at = until
        place += 1
    for index in range(4):
        mean[index] = mean[index] / (end - begin) if end > begin else now[index]


def acceleration(collective: float, attitude: Any, mass: float, gravity: float) -> Any:
    """Return the acceleration (3,) (m/s^2) along x, y, h that a collective thrust (N) and gravity give.

    The attitude is roll, pitch and yaw. The thrust points along minus the third column of Rz(yaw) Ry(pitch)
    Rx(roll), h up.
    """
    roll, pitch, yaw = float(attitude[0]), float(attitude[1]), float(attitude[2])
    across, along = math.sin(roll), math.cos(roll) * math.sin(pitch)
    cosine, sine, lift = math.cos(yaw), math.sin(yaw), collective / mass
    return np.array(
        (
            -lift * (along * cosine + across * sine),
            lift * (across * cosine - along * sine),
            lift * math.cos(roll) * math.cos(pitch) - gravity,
        )
    )
