"""What is asked of an FMU that runs, in which order."""

from __future__ import annotations

import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from quadvis.fmi.exchange import DATA, ERROR, FORGET, NUMBER, OK, RESTORE, SAVE, STEP_ON
from quadvis.fmi.running import FmuFault, LocalFmu


class FailingFmu(LocalFmu):
    """An FMU that keeps its states in its own memory, counts them, and fails in each step."""

    def __init__(self) -> None:
        setup: Any = SimpleNamespace(serialises=False, size=DATA)
        super().__init__(setup, Path())
        self.kept: list[int] = []
        self._count = 0
        self._judged = lambda request, status: status
        self._requests = {STEP_ON: lambda: ERROR, SAVE: self._save, FORGET: self._forget, RESTORE: lambda: OK}

    def _save(self) -> int:
        self._count += 1
        self.kept.append(self._count)
        struct.pack_into("q", self.buffer, NUMBER, self._count)
        return OK

    def _forget(self) -> int:
        self.kept.remove(struct.unpack_from("q", self.buffer, NUMBER)[0])
        return OK


def test_a_state_that_nobody_has_any_more_hides_no_error_of_the_step_under_way() -> None:
    fmu = FailingFmu()
    saved = fmu.save()
    fmu.ask(STEP_ON)
    del saved
    with pytest.raises(FmuFault, match="the FMU gave the status Error"):
        fmu.answer()


def test_the_memory_of_an_fmu_holds_the_states_that_somebody_has() -> None:
    fmu = FailingFmu()
    first = fmu.save()
    for _ in range(5):
        fmu.save()
    assert fmu.kept == [1, 6]
    fmu.restore(first)
    assert fmu.kept == [1]
