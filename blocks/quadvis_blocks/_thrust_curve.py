"""The thrust of a rotor over the command of its motor, and back.

``thrust / thrust_max = (1 - curve) u + curve u^2`` for a command u from 0 to 1: with ``curve`` 1 the speed of
the rotor follows the command. The same model as PX4's parameter THR_MDL_FAC.
"""

from __future__ import annotations

import math

from quadvis.block import clip

CURVE = 1.0


def thrust_share(command: float, curve: float) -> float:
    """Return the share of the greatest thrust that a command (0 to 1) gives."""
    u = clip(command, 0.0, 1.0)
    return float((1.0 - curve) * u + curve * u * u)


def command_for(share: float, curve: float) -> float:
    """Return the command (0 to 1) that gives a share of the greatest thrust."""
    y = clip(share, 0.0, 1.0)
    linear = 1.0 - curve
    if curve < 1e-9:
        return float(y)
    return (math.sqrt(linear * linear + 4.0 * curve * y) - linear) / (2.0 * curve)
