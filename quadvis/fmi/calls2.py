"""The functions of FMI 2.0, bound to a library by ctypes; statuses are returned, nothing is checked."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from typing import Any

from quadvis.fmi.bound import Call, bound, listed
from quadvis.fmi.exchange import DISCARD, ENDING, EVENT, OK, UnitSetup
from quadvis.fmi.messages import Messages

EXCHANGE, COSIMULATION = 0, 1
LAST_TIME, TERMINATED = 2, 3
NEAR = 1e-9  # s
VALUES = {
    "Float64": "Real",
    "Int32": "Integer",
    "Enumeration": "Integer",
    "Boolean": "Boolean",
    "String": "String",
}
Logger = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p
)
_heard: dict[int, Messages] = {}  # by what an instance calls its environment


def _take(environment: int, _: bytes, status: int, __: bytes, text: bytes) -> None:
    """Take a message: one function for all instances, since the library that formats knows only one."""
    if environment in _heard:
        _heard[environment].take(status, text)


_hear = Logger(_take)


class _Callbacks(ctypes.Structure):
    _fields_ = (
        ("logger", Logger),
        ("allocate", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
        ("finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    )


class _EventInfo(ctypes.Structure):
    _fields_ = (
        ("needed", ctypes.c_int),
        ("terminate", ctypes.c_int),
        ("nominals", ctypes.c_int),
        ("values", ctypes.c_int),
        ("defined", ctypes.c_int),
        ("time", ctypes.c_double),
    )


class Calls2:
    """An instance of an FMU of FMI 2.0; `instantiate` comes first."""

    def __init__(self, library: ctypes.CDLL, setup: UnitSetup, messages: Messages) -> None:
        self._library, self._setup = library, setup
        libc = ctypes.CDLL(None)
        address = [ctypes.cast(function, ctypes.c_void_p) for function in (libc.calloc, libc.free)]
        self._environment = id(self)
        _heard[self._environment] = messages
        self._callbacks = _Callbacks(_hear, *address, None, self._environment)
        if setup.proxy:
            messages.format_with(setup.proxy, ctypes.byref(self._callbacks))
        self._component = ctypes.c_void_p()
        self._info = _EventInfo()

    def _function(self, name: str) -> Any:
        return self._library[f"fmi2{name}"]  # a function of its own each time: its types belong to the caller

    def _bound(self, name: str, *arguments: Any) -> Call:
        return bound(self._function(name), self._component, *arguments)

    def instantiate(self) -> bool:
        """Make the instance; False if the FMU refuses."""
        setup, function = self._setup, self._function("Instantiate")
        function.restype = ctypes.c_void_p
        kind = COSIMULATION if setup.states is None else EXCHANGE
        texts = [text.encode() for text in (setup.token, setup.resources)]
        self._component.value = function(
            setup.name.encode(), kind, *texts, ctypes.byref(self._callbacks), 0, 0
        )
        return bool(self._component)

    def enter_initialisation(self) -> int:
        """Set the experiment up, and enter the initialisation mode."""
        none, start = ctypes.c_double(0.0), ctypes.c_double(self._setup.start_time)
        status = self._bound("SetupExperiment", 0, none, start, 0, none)()
        return status or self._bound("EnterInitializationMode")()

    def exit_initialisation(self) -> int:
        """Leave the initialisation mode."""
        return self._bound("ExitInitializationMode")()

    def setter(self, kind: str, references: Sequence[int], values: Any) -> Call:
        """Return a call that sets variables to the values of an array."""
        return self._bound(f"Set{VALUES[kind]}", *listed(references), values)

    def getter(self, kind: str, references: Sequence[int], values: Any) -> Call:
        """Return a call that writes the values of variables into an array."""
        return self._bound(f"Get{VALUES[kind]}", *listed(references), values)

    def stepper(self, time: ctypes.c_double, step: ctypes.c_double) -> Call:
        """Return a call that steps on from a time, both of which lie in the buffer."""
        return self._bound("DoStep", time, step, 1)

    def discarded(self, end: float) -> int:
        """Return what the status Discard of a step means.

        `ENDING` if the FMU asks to end the simulation; OK if it has done so at the end (s) of the step.
        """
        ended, reached = ctypes.c_int(), ctypes.c_double(-math.inf)
        asked = self._bound("GetBooleanStatus", TERMINATED, ctypes.byref(ended))()
        if asked != OK or not ended.value:
            return DISCARD
        self._bound("GetRealStatus", LAST_TIME, ctypes.byref(reached))()
        return OK if reached.value >= end - NEAR else ENDING

    def begin_continuous(self) -> int:
        """Enter the continuous-time mode for the first time; `EVENT` if an instant of an event is known."""
        info = self._info
        info.needed = 1
        while info.needed and not info.terminate:
            if status := self._bound("NewDiscreteStates", ctypes.byref(info))():
                return status
        if info.terminate:
            return ENDING
        return EVENT if info.defined else self._bound("EnterContinuousTimeMode")()

    def time_setter(self, time: ctypes.c_double) -> Call:
        """Return a call that sets the time."""
        return self._bound("SetTime", time)

    def state_setter(self, states: Any, count: int) -> Call:
        """Return a call that sets the continuous states."""
        return self._bound("SetContinuousStates", states, ctypes.c_size_t(count))

    def state_getter(self, states: Any, count: int) -> Call:
        """Return a call that gets the continuous states."""
        return self._bound("GetContinuousStates", states, ctypes.c_size_t(count))

    def slope_getter(self, slopes: Any, count: int) -> Call:
        """Return a call that gets the derivatives of the states."""
        return self._bound("GetDerivatives", slopes, ctypes.c_size_t(count))

    def completer(self) -> Call:
        """Return a call that says that a step of the solver is complete; `EVENT` if the FMU has an event."""
        event, ended = ctypes.c_int(), ctypes.c_int()
        complete = self._bound("CompletedIntegratorStep", 1, ctypes.byref(event), ctypes.byref(ended))

        def call() -> int:
            return complete() or (ENDING if ended.value else EVENT if event.value else OK)

        return call

    def save(self, state: ctypes.c_void_p) -> int:
        """Keep the whole state in memory of the FMU."""
        return self._bound("GetFMUstate", ctypes.byref(state))()

    def restore(self, state: ctypes.c_void_p) -> int:
        """Go back to a kept state."""
        return self._bound("SetFMUstate", state)()

    def forget(self, state: ctypes.c_void_p) -> int:
        """Free the memory of a kept state."""
        return self._bound("FreeFMUstate", ctypes.byref(state))()

    def serialised(self, state: ctypes.c_void_p, most: int) -> tuple[int, bytes]:
        """Return the status, and a kept state as bytes."""
        size = ctypes.c_size_t()
        if status := self._bound("SerializedFMUstateSize", state, ctypes.byref(size))():
            return status, b""
        if size.value > most:
            return ENDING, b""
        data = ctypes.create_string_buffer(size.value)
        return self._bound("SerializeFMUstate", state, data, size)(), data.raw

    def deserialise(self, data: bytes, state: ctypes.c_void_p) -> int:
        """Make a kept state of bytes."""
        size = ctypes.c_size_t(len(data))
        return self._bound("DeSerializeFMUstate", data, size, ctypes.byref(state))()

    def end(self, *, terminate: bool) -> None:
        """Terminate and free the instance."""
        if self._component:
            if terminate:
                self._bound("Terminate")()
            self._bound("FreeInstance")()
            self._component.value = None
        _heard.pop(self._environment, None)
