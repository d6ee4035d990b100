"""Modules that stand in for the drivers of cards, and what was written by them."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

STAND_INS = Path(__file__).parent / "stand_ins"
MODULES = ("card", "comedi", "comedi.comedi", "nidaqmx", "nidaqmx.errors", "nidaqmx.constants")


class Cards:
    """Cards in a folder: ``module`` is what the stand-ins have in common in this process."""

    def __init__(self, folder: Path, module: Any) -> None:
        self.module = module
        self.log, self._refusing = folder / "card.log", folder / "refusing"
        self.device = folder / "comedi0"
        self.device.touch()

    def refuse(self, *channels: int) -> None:
        """Let channels (from 0) refuse."""
        self._refusing.write_text("\n".join(map(str, channels)))

    @property
    def writes(self) -> list[tuple[int, str, int, float]]:
        """All writes: instant (ns), what, channel (from 0), value."""
        found: list[tuple[int, str, int, float]] = self.module.writes(self.log)
        return found

    def last(self) -> dict[int, float]:
        """Return the value that was written last, by channel."""
        return {channel: value for _, _, channel, value in self.writes}


@contextmanager
def standing_in(folder: Path) -> Iterator[Cards]:
    """Let modules of this process and of those that it begins be the stand-ins."""
    with pytest.MonkeyPatch.context() as patch:
        for name in MODULES:
            patch.delitem(sys.modules, name, raising=False)
        patch.syspath_prepend(str(STAND_INS))
        patch.setenv("PYTHONPATH", str(STAND_INS))
        patch.setenv("CARD_LOG", str(folder / "card.log"))
        patch.setenv("CARD_REFUSES", str(folder / "refusing"))
        import card

        yield Cards(folder, card)
        for name in MODULES:
            sys.modules.pop(name, None)
