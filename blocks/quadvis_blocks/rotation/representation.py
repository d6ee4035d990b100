"""Quaternions, matrices and Euler angles into each other."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._rotations import (
    dcm_of_euler,
    dcm_of_quaternion,
    euler_of_dcm,
    quaternion_of_dcm,
    quaternion_of_euler,
)

TYPES = {"quaternion": ("float64[4]", "1"), "dcm": ("float64[3,3]", "1"), "euler": ("float64[3]", "rad")}
KINDS = (
    "euler_to_quaternion", "quaternion_to_euler", "euler_to_dcm", "dcm_to_euler", "quaternion_to_dcm",
    "dcm_to_quaternion",
)  # fmt: skip


class Representation(Block):
    """A rotation in another form: quaternion, direction cosine matrix (DCM), or Euler angles.

    Quaternions are (w, x, y, z). They and matrices turn body vectors into world vectors; Euler angles are
    roll, pitch and yaw with ``R = Rz(yaw) Ry(pitch) Rx(roll)``. A quaternion of any norm but 0 will do.
    Pitch comes out within +-90 deg, and at +-90 deg roll is 0. A quaternion that comes out has the norm
    1; the first has w >= 0, and from then on its sign does not jump.

    Sources: J. B. Kuipers, Quaternions and Rotation Sequences, chapters 5 to 7; S. W. Shepperd,
    Quaternion from Rotation Matrix, Journal of Guidance and Control 1 (1978).
    """

    kind = Param("euler_to_quaternion", choices=KINDS, shown=True, doc="from which form into which")
    u = In("float64[3]", unit="rad", doc="the rotation")
    y = Out("float64[4]", doc="the same rotation in the other form")
    last = State("float64[4]", doc="the last quaternion")

    example = """
        angles: {block: sources.constant, rate: fast, with: {value: [10 deg, 0 rad, 1 rad]}}
        attitude: {block: rotation.representation, rate: fast, in: {u: angles.y}}
    """

    @classmethod
    def ports(cls, kind: int) -> dict[str, Any]:
        """Return ports and methods for the forms."""
        given, _, wanted = KINDS[kind].partition("_to_")
        (taken, unit), (made, unit_made) = TYPES[given], TYPES[wanted]
        return {
            "u": In(taken, unit=unit, doc=cls.u.doc),
            "y": Out(made, unit=unit_made, doc=cls.y.doc),
            **_METHODS[kind],
        }

    def output(self, u: Any) -> Any:
        """Return the quaternion of Euler angles."""
        return _near(quaternion_of_euler(u), self.last)

    def update(self, u: Any) -> None:
        """Keep the quaternion."""
        self.last = _near(quaternion_of_euler(u), self.last)


def _near(q: Any, last: Any) -> Any:
    """Return q or -q, the one that is nearer to the last quaternion."""
    return -q if q[0] * last[0] + q[1] * last[1] + q[2] * last[2] + q[3] * last[3] < 0.0 else q


def _quaternion_to_euler(self: Any, u: Any) -> Any:
    """Return roll, pitch and yaw."""
    return euler_of_dcm(dcm_of_quaternion(u))


def _euler_to_dcm(self: Any, u: Any) -> Any:
    """Return the matrix."""
    return dcm_of_euler(u)


def _dcm_to_euler(self: Any, u: Any) -> Any:
    """Return roll, pitch and yaw."""
    return euler_of_dcm(u)


def _quaternion_to_dcm(self: Any, u: Any) -> Any:
    """Return the matrix."""
    return dcm_of_quaternion(u)


def _dcm_to_quaternion(self: Any, u: Any) -> Any:
    """Return the quaternion."""
    return _near(quaternion_of_dcm(u), self.last)


def _keep(self: Any, u: Any) -> None:
    """Keep the quaternion."""
    self.last = _near(quaternion_of_dcm(u), self.last)


_METHODS: list[dict[str, Any]] = [
    {},
    {"output": _quaternion_to_euler, "update": None},
    {"output": _euler_to_dcm, "update": None},
    {"output": _dcm_to_euler, "update": None},
    {"output": _quaternion_to_dcm, "update": None},
    {"output": _dcm_to_quaternion, "update": _keep},
]
