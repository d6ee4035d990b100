"""A reference whose errors count as far as vision can be trusted."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out
from quadvis_blocks._angles import wrapped


class TrustedReference(Block):
    """The reference drawn towards the craft, so that errors count by a weight: ``e' = weight e``.

    With weight 0, an unknown horizontal position or heading gives no error, so the control laws level the
    craft; an unknown velocity counts as the velocity of the reference. Height and vertical speed pass
    unchanged.
    """

    position_reference = In("float64[3]", unit="m", doc="where to be: x, y, h")
    velocity_reference = In("float64[3]", unit="m/s", default=(0.0, 0.0, 0.0), doc="velocity to fly")
    heading_reference = In(unit="rad", doc="heading to hold")
    position = In("float64[3]", unit="m", doc="where the craft is: x, y, h")
    velocity = In("float64[3]", unit="m/s", doc="rate of change of the position")
    heading = In(unit="rad", doc="heading of the craft")
    position_weight = In(doc="weight of horizontal position and heading, 0 to 1")
    velocity_weight = In(doc="weight of horizontal velocity, 0 to 1")
    trusted_position = Out("float64[3]", unit="m", doc="where to be: x, y, h")
    trusted_velocity = Out("float64[3]", unit="m/s", doc="velocity to fly")
    trusted_heading = Out(unit="rad", doc="heading to hold, in (-pi, pi]")

    example = """
        weight: {block: sources.ramp, rate: fast, with: {initial: 1, slope: -1}}
        reference:
          block: supervision.trusted_reference
          rate: fast
          in:
            position_reference: {value: [0, 0, 1.5], unit: m}
            heading_reference: 0 rad
            position: {value: [0.4, 0, 1.4], unit: m}
            velocity: {value: [0.1, 0, 0], unit: m/s}
            heading: 5 deg
            position_weight: weight.y
            velocity_weight: weight.y
    """

    def output(
        self, position_reference: Any, velocity_reference: Any, heading_reference: float, position: Any,
        velocity: Any, heading: float, position_weight: float, velocity_weight: float,
    ) -> tuple[Any, Any, float]:  # fmt: skip
        """Return the reference with its errors weighted."""
        place = _drawn(position_reference, position, position_weight)
        pace = _drawn(velocity_reference, velocity, velocity_weight)
        turn = wrapped(heading - heading_reference)
        return place, pace, wrapped(heading_reference + (1.0 - position_weight) * turn)


def _drawn(reference: Any, value: Any, weight: float) -> Any:
    """Return the reference with x and y drawn towards the value; weight 1 keeps it to the bit."""
    rest = 1.0 - weight
    x = reference[0] + rest * (value[0] - reference[0])
    y = reference[1] + rest * (value[1] - reference[1])
    return np.array((x, y, reference[2]))
