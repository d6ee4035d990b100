"""Which of all that speak on a link is the autopilot: one system and component, for a whole run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from quadvis_blocks.mavlink._scanner import Packet, Sender

NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID: what components say that are no autopilot
PX4, ARDUPILOT = 12, 3  # MAV_AUTOPILOT
# MAV_TYPE of what is no vehicle: ground station, computer on board, gimbal, transponder, camera, radio, ...
NO_VEHICLES = frozenset({5, 6, 18, 26, 27, 30, 31, 32, 33, 34, 36, 37, 38, 39, 40, 41, 42, 43})


class AutopilotIdentity:
    """The autopilot: its ``system`` and ``component`` as declared, 0 where its first heartbeat says it.

    Once both are known they stay. ``others`` counts the messages of all others, by sender.
    """

    def __init__(self, system: int, component: int) -> None:
        self.system, self.component = system, component
        self.firmware = NO_AUTOPILOT  # MAV_AUTOPILOT, from its first heartbeat on
        self.others: Counter[Sender] = Counter()
        self._early: Counter[Sender] = Counter()  # messages from before it is known who is who

    @property
    def is_known(self) -> bool:
        """True if both numbers are known."""
        return bool(self.system and self.component)

    def meet(self, packet: Packet, heartbeat: Mapping[str, Any]) -> None:
        """Take the missing numbers from a heartbeat, if it is that of an autopilot that may be meant."""
        is_real = heartbeat["autopilot"] != NO_AUTOPILOT and heartbeat["type"] not in NO_VEHICLES
        system, component = packet.sender
        fits = self.system in (0, system) and self.component in (0, component)
        if is_real and fits and not self.is_known:
            self.system, self.component = system, component
            del self._early[packet.sender]
            self.others += self._early
        if is_real and packet.sender == (self.system, self.component):
            self.firmware = int(heartbeat["autopilot"])

    def speaks(self, packet: Packet) -> bool:
        """Return whether a packet is the autopilot's; count it if it is not."""
        if packet.sender == (self.system, self.component):
            return True
        (self.others if self.is_known else self._early)[packet.sender] += 1
        return False
