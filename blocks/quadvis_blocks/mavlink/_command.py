"""Set-points: what all blocks have in common that repeat a command to an autopilot."""

from __future__ import annotations

from typing import Any

from quadvis.block import Output, Param
from quadvis_blocks.mavlink._station import SYSTEMS, Station


class StationCommand(Station, Output):
    """A command that is repeated every ``spacing``, changed or not.

    At every end, and when the loop is killed or hangs, ``safe`` is sent for the ``safe_time``; then comes a
    message that releases the autopilot, and nothing more. What the autopilot does without set-points is
    its own failsafe: see its time-outs, which `mavlink.autopilot` reads.
    """

    rate = "spacing"
    hold = "safe_time"

    target_system = Param(1, type="int64", min=0, max=SYSTEMS, doc="number of the autopilot's system; 0: all")
    target_component = Param(1, type="int64", min=0, max=SYSTEMS, doc="number of its component; 0: all")
    spacing = Param(0.02, unit="s", min=2e-3, max=0.4, doc="from one set-point to the next")
    safe_time = Param(2.0, unit="s", above=0.0, max=600.0, doc="how long safe set-points are sent at an end")

    def target(self) -> dict[str, Any]:
        """Return the fields that say to whom a message goes."""
        return {"target_system": self.target_system, "target_component": self.target_component}
