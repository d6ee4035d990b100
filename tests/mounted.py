"""Diagrams whose simulated camera sits askew on the craft and away from its middle, as scipy turns it."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

DIAGRAMS = Path(__file__).parents[1] / "diagrams"
BLOCK = '''"""A device on the craft."""

from scipy.spatial.transform import Rotation

from quadvis.block import Block, In, Out, Param


class Device(Block, numeric=False):
    """Position and attitude of a device from those of the craft; its offset is forward, right, up."""

    offset = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m")
    angles = Param((0.0, 0.0, 0.0), type="float64[3]", unit="rad")
    position = In("float64[3]", unit="m")
    attitude = In("float64[3]", unit="rad")
    place = Out("float64[3]", unit="m")
    turned = Out("float64[3]", unit="rad")

    def output(self, position, attitude):
        craft = Rotation.from_euler("ZYX", attitude[::-1])
        place = position + craft.apply(self.offset * (1, 1, -1)) * (1, 1, -1)
        return place, (craft * Rotation.from_euler("ZYX", self.angles[::-1])).as_euler("ZYX")[::-1]
'''
DIAGRAM = """quadvis: 1
name: mounted
base: {{file: hover.yaml, variant: {variant}}}
blocks:
  device:
    block: rig.device
    rate: vision
    with: {{offset: {{value: {offset}, unit: m}}, angles: {{value: {angles}, unit: rad}}}}
    in:
      position: {{from: craft.position, across: sample}}
      attitude: {{from: craft.attitude, across: sample}}
  eyes:
    part: parts/geometric_eyes.yaml
    with: {{ceiling: $ceiling, side: $side}}
    in: {{position: device.place, attitude: device.turned}}
{more}"""


def mounted(
    folder: Path, variant: str, offset: Sequence[float], angles: Sequence[float], more: str = ""
) -> Path:
    """Write hover.yaml with such a camera, and with `more` blocks, into a copy of all diagrams; return it."""
    diagrams = folder / "diagrams"
    shutil.copytree(DIAGRAMS, diagrams, dirs_exist_ok=True)
    (diagrams / "blocks" / "rig").mkdir(parents=True, exist_ok=True)
    (diagrams / "blocks" / "rig" / "device.py").write_text(BLOCK)
    path = diagrams / "mounted.yaml"
    path.write_text(DIAGRAM.format(variant=variant, offset=list(offset), angles=list(angles), more=more))
    return path


TURNTABLE = '''"""A craft on a turntable."""

import math

import numpy as np

from quadvis.block import Block, Out, Param


class Turntable(Block, numeric=False):
    """A craft that turns about its own middle, on a table that is not quite level and rocks."""

    rate = Param(0.1, unit="rad/s")
    position = Out("float64[3]", unit="m")
    attitude = Out("float64[3]", unit="rad")
    rates = Out("float64[3]", unit="rad/s")

    def output(self, time):
        rock = 0.03 * np.array((math.sin(2.1 * time), math.cos(1.7 * time), 0.0))
        slide = 0.005 * np.array((math.sin(0.7 * time), math.cos(0.31 * time), 0.0))
        turned = np.array((0.01, 0.0, self.rate * time))
        return np.array((0.1, -0.05, 1.5)) + slide, turned + rock, np.array((0.0, 0.0, self.rate))
'''


def on_turntable(folder: Path, offset: Sequence[float], angles: Sequence[float], rate: float) -> Path:
    """Write such a diagram whose craft stands on a turntable that turns at a rate in rad/s; return it."""
    more = f"  craft: {{block: rig.turntable, rate: imu, with: {{rate: {rate} rad/s}}, in: {{}}}}\n"
    path = mounted(folder, "geometric", offset, angles, more)
    (path.parent / "blocks" / "rig" / "turntable.py").write_text(TURNTABLE)
    return path
