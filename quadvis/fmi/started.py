"""An FMU that runs, as a block uses it: values of its signals in SI units in and out, steps, states."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis.fmi.exchange import COMPLETE, GET, SET_GET, SLOPES, STEP_ON, TIME, TUNE, Laid
from quadvis.fmi.packing import FIT, packer, unpacker
from quadvis.fmi.running import IsolatedFmu, LocalFmu, SavedFmu
from quadvis.fmi.signals import FmuSignal
from quadvis.fmi.unpacked import UnpackedFmu

Floats = NDArray[np.float64]
_INSTANT, _STEP = struct.Struct("d").pack_into, struct.Struct("2d").pack_into


@dataclass(frozen=True)
class FmuLayout:
    """Where everything lies in the buffer of an exchange: inputs, outputs and tunable parameters.

    ``direct_places`` are those of the inputs that outputs follow; ``states_at`` and ``slopes_at`` are bytes.
    """

    inputs: Laid
    outputs: Laid
    tunable: Laid
    direct_places: list[int]
    states_at: int
    slopes_at: int
    size: int


class StartedFmu:
    """An FMU between its start and `close`; QuadvisError, in a sentence, when it cannot go on.

    ``signals`` are the inputs, the outputs, the tunable parameters, and the inputs that outputs follow.
    ``values`` are those of parameters by name. A step is only begun: what is asked next waits for its end.
    """

    def __init__(
        self,
        version: int,
        signals: Sequence[Sequence[FmuSignal]],
        layout: FmuLayout,
        unpacked: UnpackedFmu,
        fmu: LocalFmu | IsolatedFmu,
        values: Mapping[str, Any],
    ) -> None:
        inputs, outputs, tunable, direct = signals
        self._fmu, self._unpacked, self._waits = fmu, unpacked, False
        self._ask, self._answer = fmu.ask, fmu.answer
        self._buffer = buffer = fmu.buffer
        self._put = packer(version, inputs, layout.inputs.places, buffer)
        self._get = unpacker(version, outputs, layout.outputs.places, buffer)
        self._put_tunable = packer(version, tunable, layout.tunable.places, buffer)
        self._put_direct = packer(version, direct, layout.direct_places, buffer)
        count = (layout.slopes_at - layout.states_at) // 8
        self._states = np.ndarray((count,), np.float64, buffer, layout.states_at)
        self._slopes = np.ndarray((count,), np.float64, buffer, layout.slopes_at)
        try:
            self._write(self._put_tunable, [values[signal.name] for signal in tunable])
            fmu.open()
        except BaseException:
            self.close()
            raise
        self.first: Floats = self._states.copy()  # the states at the start

    def step(self, time: float, period: float, inputs: Sequence[Any]) -> None:
        """Set the inputs and begin a step of a period from a time on (s)."""
        if self._waits:
            self._finish()
        try:
            self._put(*inputs)
        except FIT as error:
            raise _unfit(error) from None
        _STEP(self._buffer, TIME, time, period)
        self._ask(STEP_ON)
        self._waits = True

    def outputs(self) -> Any:
        """Return the outputs at the end of the last step: one, or a tuple of several."""
        if self._waits:
            self._waits = False
            self._answer()
        return self._get()

    def following(self, inputs: Sequence[Any]) -> Any:
        """Return the outputs with new values of the inputs that they follow."""
        self._finish()
        self._write(self._put_direct, inputs)
        self._do(SET_GET)
        return self._get()

    def at(self, time: float, states: Floats, inputs: Sequence[Any]) -> Any:
        """Return the outputs at a time (s) and states, with new values of the inputs that they follow."""
        self._place(time, states)
        return self.following(inputs)

    def slopes(self, time: float, states: Floats, inputs: Sequence[Any]) -> Floats:
        """Return the derivatives of the states at a time (s)."""
        self._place(time, states)
        self._write(self._put, inputs)
        self._do(SLOPES)
        return self._slopes.copy()

    def complete(self, time: float, states: Floats, inputs: Sequence[Any]) -> None:
        """Say that a step of the solver is complete."""
        self._place(time, states)
        self._write(self._put, inputs)
        self._do(COMPLETE)

    def tune(self, values: Sequence[Any]) -> None:
        """Give the tunable parameters new values."""
        self._finish()
        self._write(self._put_tunable, values)
        self._do(TUNE)

    def save(self) -> SavedFmu:
        """Return the FMU's own state."""
        self._finish()
        return self._fmu.save()

    def restore(self, saved: SavedFmu) -> None:
        """Go back to a state of this FMU."""
        self._finish()
        self._fmu.restore(saved)
        self._do(GET)

    def close(self) -> None:
        """End the FMU and remove its copy."""
        try:
            self._fmu.close()
        finally:
            self._unpacked.remove()

    def _place(self, time: float, states: Floats) -> None:
        _INSTANT(self._buffer, TIME, time)
        self._states[...] = states

    def _finish(self) -> None:
        if self._waits:
            self._waits = False
            self._answer()

    def _do(self, request: int) -> None:
        self._ask(request)
        self._answer()

    def _write(self, put: Any, values: Sequence[Any]) -> None:
        try:
            put(*values)
        except FIT as error:
            raise _unfit(error) from None


def _unfit(error: Exception) -> QuadvisError:
    return QuadvisError(f"a value does not fit into its type in the FMU: {error}")
