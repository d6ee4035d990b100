"""What Betaflight says about itself: modes, and why it does not arm, in words."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

ARM, FAILSAFE = 0, 27  # permanent numbers of modes
RECEIVER_LOST = 1 << 2
ARM_SWITCH = 1 << 28  # set with any other reason while the switch is on
RANGE = struct.Struct("<4B")  # mode, auxiliary channel, first and last step
LOWEST, STEP = 900, 25  # us: pulse of step 0, and width of a step
FIXED = 4  # channels before the auxiliary ones
FRAME = struct.Struct("<3HI B H 3B")  # up to the number of further bytes of modes
FLAGS = struct.Struct("<BI")

# By bit, from Betaflight's src/main/fc/runtime_config.h; the names are those of its command line.
REASONS = (
    "no gyro was found",
    "failsafe is active",
    "no receiver signal, or not for long enough",
    "the arm switch was on when the receiver signal came",
    "the failsafe switch is on",
    "runaway take-off prevention has stopped it",
    "a crash was detected",
    "throttle not low",
    "the craft is not level",
    "too soon after power-on",
    "the pre-arm switch is off",
    "its processor is overloaded",
    "sensors are being calibrated",
    "the command line is open",
    "its menu is open",
    "a BST command forbids it",
    "an MSP command forbids it",
    "the paralyze switch is on",
    "no GPS fix",
    "the GPS rescue switch is on",
    "no DSHOT telemetry from a motor",
    "a setting needs a restart",
    "DSHOT bit banging failed",
    "the accelerometer was never calibrated",
    "no motor protocol is chosen",
    "the crash flip switch is on",
    "the altitude hold switch is on",
    "the position hold switch is on",
    "the arm switch is on: switch it off and on again",
)


class Status(NamedTuple):
    """The state of the firmware: bits of active modes, and of the reasons why it does not arm."""

    modes: int
    reasons: int

    @staticmethod
    def of(payload: bytes) -> Status | None:
        """Return what MSP_STATUS_EX says; None if it is too short."""
        if len(payload) < FRAME.size:
            return None
        _, _, _, modes, *_, further = FRAME.unpack_from(payload)
        start = FRAME.size + (further & 0x0F)
        if len(payload) < start + FLAGS.size:
            return None
        modes |= int.from_bytes(payload[FRAME.size : start], "little") << 32
        return Status(modes, FLAGS.unpack_from(payload, start)[1])


def words(reasons: int) -> str:
    """Return the reasons in words."""
    found = [text for bit, text in enumerate(REASONS) if reasons >> bit & 1]
    found += [f"reason {bit}" for bit in range(len(REASONS), 32) if reasons >> bit & 1]
    return "; ".join(found) or "it gives none"


class ModeRange(NamedTuple):
    """Pulses of a channel that switch a mode on: ``channel`` counts from 0, the ends are in us."""

    channel: int
    lowest: int
    highest: int

    def holds(self, channels: Sequence[float]) -> bool:
        """Return whether the channels switch it on."""
        return self.channel < len(channels) and self.lowest <= channels[self.channel] < self.highest


def arming_ranges(payload: bytes) -> list[ModeRange]:
    """Return the ranges that arm, of what MSP_MODE_RANGES says."""
    whole = payload[: len(payload) - len(payload) % RANGE.size]
    return [
        ModeRange(FIXED + channel, LOWEST + STEP * first, LOWEST + STEP * last)
        for mode, channel, first, last in RANGE.iter_unpack(whole)
        if mode == ARM and first < last
    ]
