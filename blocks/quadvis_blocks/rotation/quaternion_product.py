"""Rotations one after the other."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._rotations import quaternion_product

NONE, FIRST, SECOND = range(3)


class QuaternionProduct(Block):
    """The product of two quaternions (w, x, y, z): the rotation q, then p, ``y = p q``.

    With ``conjugate: first`` it is ``p* q``, the rotation from p to q in the axes of p, which is the error of
    an attitude; with ``second`` it is ``p q*``.

    Source: J. B. Kuipers, Quaternions and Rotation Sequences, chapter 5.
    """

    conjugate = Param("none", choices=("none", "first", "second"), doc="which of them is turned around")
    p = In("float64[4]", doc="the first factor")
    q = In("float64[4]", doc="the second factor")
    y = Out("float64[4]", doc="the product")

    example = """
        attitude: {block: sources.constant, rate: fast, with: {value: [0.6, 0.8, 0, 0]}}
        wanted: {block: sources.constant, rate: fast, with: {value: [0.8, 0.6, 0, 0]}}
        error:
          block: rotation.quaternion_product
          rate: fast
          with: {conjugate: first}
          in: {p: attitude.y, q: wanted.y}
    """

    def output(self, p: Any, q: Any) -> Any:
        """Return the product."""
        if self.conjugate == FIRST:
            return quaternion_product(_conjugate(p), q)
        if self.conjugate == SECOND:
            return quaternion_product(p, _conjugate(q))
        return quaternion_product(p, q)


def _conjugate(q: Any) -> Any:
    """Return (w, -x, -y, -z)."""
    turned = -q
    turned[0] = q[0]
    return turned
