"""The axes and buttons of joysticks by their names in <linux/input-event-codes.h>."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from quadvis.errors import suggestion

EV_SYN, EV_KEY, EV_ABS = 0, 1, 3
SYN_REPORT, SYN_DROPPED = 0, 3
MOST_ABS, MOST_KEY = 0x3F, 0x2FF

_AXES = {
    0x00: "X Y Z RX RY RZ THROTTLE RUDDER WHEEL GAS BRAKE",
    0x10: "HAT0X HAT0Y HAT1X HAT1Y HAT2X HAT2Y HAT3X HAT3Y PRESSURE DISTANCE TILT_X TILT_Y TOOL_WIDTH",
    0x20: "VOLUME PROFILE",
    0x28: "MISC",
}
_BUTTONS = {
    0x100: "0 1 2 3 4 5 6 7 8 9",
    0x120: "TRIGGER THUMB THUMB2 TOP TOP2 PINKIE BASE BASE2 BASE3 BASE4 BASE5 BASE6",
    0x12F: "DEAD SOUTH EAST C NORTH WEST Z TL TR TL2 TR2 SELECT START MODE THUMBL THUMBR",
    0x150: "GEAR_DOWN GEAR_UP",
    0x220: "DPAD_UP DPAD_DOWN DPAD_LEFT DPAD_RIGHT",
    0x2C0: " ".join(f"TRIGGER_HAPPY{number}" for number in range(1, 41)),
}
HATS = range(0x10, 0x18)  # axes with three positions
JOYSTICK_BUTTONS = (range(0x120, 0x140), range(0x2C0, 0x2E8))  # what makes a device a joystick


class EventCode(NamedTuple):
    """What an event is about: its type, and the code of an axis (EV_ABS) or a button (EV_KEY)."""

    kind: int
    code: int

    def __str__(self) -> str:
        """Return the name, or such as ABS_41 where there is none."""
        return _NAMES.get(self) or f"{'ABS' if self.kind == EV_ABS else 'KEY'}_{self.code}"


def _named() -> Iterator[tuple[str, EventCode]]:
    for kind, prefix, table in ((EV_ABS, "ABS_", _AXES), (EV_KEY, "BTN_", _BUTTONS)):
        for first, names in table.items():
            for offset, name in enumerate(names.split()):
                yield prefix + name, EventCode(kind, first + offset)
    for alias, code in (("BTN_A", 0x130), ("BTN_B", 0x131), ("BTN_X", 0x133), ("BTN_Y", 0x134)):
        yield alias, EventCode(EV_KEY, code)


CODES = dict(_named())
_NAMES = {code: name for name, code in reversed(CODES.items())}


def event_code(word: str) -> EventCode | None:
    """Return what a word stands for: ABS_X, BTN_TR, or by number ABS_41, KEY_288; None if it is none."""
    if word in CODES:
        return CODES[word]
    prefix, _, digits = word.partition("_")
    kind, most = {"ABS": (EV_ABS, MOST_ABS), "KEY": (EV_KEY, MOST_KEY)}.get(prefix, (EV_SYN, -1))
    return EventCode(kind, int(digits)) if digits.isdecimal() and int(digits) <= most else None


def likely(word: str) -> str:
    """Return the remedy for a word that is no name."""
    return suggestion(word, CODES) or "write such as ABS_X, BTN_TR, or by number ABS_41, KEY_288"
