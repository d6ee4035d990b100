"""A vector turned by a rotation."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._rotations import dcm_of_euler, dcm_of_quaternion, turned_by

TYPES = (("float64[4]", "1"), ("float64[3,3]", "1"), ("float64[3]", "rad"))
TO_WORLD, TO_BODY = range(2)


class Rotate(Block):
    """A vector turned by a rotation: from the body's axes to the world's, or back.

    ``to_world``: ``y = R v``; ``to_body``: ``y = R' v``. The rotation is a quaternion (w, x, y, z) of any
    norm but 0, a direction cosine matrix, or roll, pitch and yaw with ``R = Rz(yaw) Ry(pitch) Rx(roll)``;
    they turn body vectors into world vectors. The elements of the vector have one unit.

    Source: J. B. Kuipers, Quaternions and Rotation Sequences, chapter 5.
    """

    by = Param(
        "quaternion", choices=("quaternion", "dcm", "euler"), shown=True, doc="the form of the rotation"
    )
    direction = Param("to_world", choices=("to_world", "to_body"), doc="from which axes to which")
    attitude = In("float64[4]", doc="the rotation")
    v = In("float64[3]", unit="a", doc="the vector")
    y = Out("float64[3]", unit="a", doc="the vector in the other axes")

    example = """
        angles: {block: sources.constant, rate: fast, with: {value: [0 rad, 0 rad, 90 deg]}}
        velocity: {block: sources.constant, rate: fast, with: {value: [2 m/s, 0 m/s, 0 m/s]}}
        world:
          block: rotation.rotate
          rate: fast
          with: {by: euler}
          in: {attitude: angles.y, v: velocity.y}
    """

    @classmethod
    def ports(cls, by: int) -> dict[str, Any]:
        """Return the port for the form."""
        type, unit = TYPES[by]
        made: dict[str, Any] = {"attitude": In(type, unit=unit, doc=cls.attitude.doc)}
        return made | ({"output": (_by_dcm, _by_euler)[by - 1]} if by else {})

    def output(self, attitude: Any, v: Any) -> Any:
        """Return the vector, turned by a quaternion."""
        return turned_by(dcm_of_quaternion(attitude), v, self.direction == TO_BODY)


def _by_dcm(self: Any, attitude: Any, v: Any) -> Any:
    """Return the vector, turned by a matrix."""
    return turned_by(attitude, v, self.direction == TO_BODY)


def _by_euler(self: Any, attitude: Any, v: Any) -> Any:
    """Return the vector, turned by roll, pitch and yaw."""
    return turned_by(dcm_of_euler(attitude), v, self.direction == TO_BODY)
