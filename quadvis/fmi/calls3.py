"""The functions of FMI 3.0, bound to a library by ctypes; statuses are returned, nothing is checked."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from quadvis.fmi.bound import Call, bound, listed
from quadvis.fmi.exchange import DISCARD, ENDING, EVENT, OK, UnitSetup
from quadvis.fmi.messages import Messages

Logger = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
_FALSE, _TRUE = ctypes.c_bool(False), ctypes.c_bool(True)


class Calls3:
    """An instance of an FMU of FMI 3.0; `instantiate` comes first. The methods are those of `Calls2`."""

    def __init__(self, library: ctypes.CDLL, setup: UnitSetup, messages: Messages) -> None:
        self._library, self._setup = library, setup
        self._logger = Logger(lambda _, status, __, text: messages.take(status, text))
        self._component = ctypes.c_void_p()

    def _function(self, name: str) -> Any:
        return self._library[f"fmi3{name}"]

    def _bound(self, name: str, *arguments: Any) -> Call:
        return bound(self._function(name), self._component, *arguments)

    def instantiate(self) -> bool:
        """Make the instance; False if the FMU refuses."""
        setup = self._setup
        name = "CoSimulation" if setup.states is None else "ModelExchange"
        function = self._function(f"Instantiate{name}")
        function.restype = ctypes.c_void_p
        resources = setup.resources.encode() or None
        head = (setup.name.encode(), setup.token.encode(), resources, _FALSE, _FALSE)
        # No event mode, no early return, no intermediate variables.
        extra = (_FALSE, _FALSE, None, ctypes.c_size_t(0)) if setup.states is None else ()
        tail = (None, self._logger, *((None,) if setup.states is None else ()))
        self._component.value = function(*head, *extra, *tail)
        return bool(self._component)

    def enter_initialisation(self) -> int:
        """Enter the initialisation mode."""
        none, start = ctypes.c_double(0.0), ctypes.c_double(self._setup.start_time)
        return self._bound("EnterInitializationMode", _FALSE, none, start, _FALSE, none)()

    def exit_initialisation(self) -> int:
        """Leave the initialisation mode."""
        return self._bound("ExitInitializationMode")()

    def setter(self, kind: str, references: Sequence[int], values: Any) -> Call:
        """Return a call that sets variables to the values of an array."""
        return self._bound(f"Set{_named(kind)}", *listed(references), values, ctypes.c_size_t(len(values)))

    def getter(self, kind: str, references: Sequence[int], values: Any) -> Call:
        """Return a call that writes the values of variables into an array."""
        return self._bound(f"Get{_named(kind)}", *listed(references), values, ctypes.c_size_t(len(values)))

    def stepper(self, time: ctypes.c_double, step: ctypes.c_double) -> Call:
        """Return a call that steps on from a time, both of which lie in the buffer."""
        event, ended, early, reached = ctypes.c_bool(), ctypes.c_bool(), ctypes.c_bool(), ctypes.c_double()
        answers = [ctypes.pointer(each) for each in (event, ended, early, reached)]
        step_on = self._bound("DoStep", time, step, _TRUE, *answers)

        def call() -> int:
            if ended.value:  # it has asked for that at the end of the step before
                return ENDING
            status = step_on()
            if early.value and status == OK:
                return ENDING if ended.value else DISCARD
            return status

        return call

    def discarded(self, _: float) -> int:
        """Return what the status Discard of a step means."""
        return DISCARD

    def begin_continuous(self) -> int:
        """Enter the continuous-time mode for the first time; `EVENT` if an instant of an event is known."""
        flags, time = [ctypes.c_bool(True) for _ in range(5)], ctypes.c_double()
        needed, ended, _, _, defined = flags
        ended.value = False
        update = self._bound("UpdateDiscreteStates", *map(ctypes.byref, flags), ctypes.byref(time))
        while needed.value and not ended.value:
            if status := update():
                return status
        if ended.value:
            return ENDING
        return EVENT if defined.value else self._bound("EnterContinuousTimeMode")()

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
        return self._bound("GetContinuousStateDerivatives", slopes, ctypes.c_size_t(count))

    def completer(self) -> Call:
        """Return a call that says that a step of the solver is complete; `EVENT` if the FMU has an event."""
        event, ended = ctypes.c_bool(), ctypes.c_bool()
        complete = self._bound("CompletedIntegratorStep", _TRUE, ctypes.byref(event), ctypes.byref(ended))

        def call() -> int:
            return complete() or (ENDING if ended.value else EVENT if event.value else OK)

        return call

    def save(self, state: ctypes.c_void_p) -> int:
        """Keep the whole state in memory of the FMU."""
        return self._bound("GetFMUState", ctypes.byref(state))()

    def restore(self, state: ctypes.c_void_p) -> int:
        """Go back to a kept state."""
        return self._bound("SetFMUState", state)()

    def forget(self, state: ctypes.c_void_p) -> int:
        """Free the memory of a kept state."""
        return self._bound("FreeFMUState", ctypes.byref(state))()

    def serialised(self, state: ctypes.c_void_p, most: int) -> tuple[int, bytes]:
        """Return the status, and a kept state as bytes."""
        size = ctypes.c_size_t()
        if status := self._bound("SerializedFMUStateSize", state, ctypes.byref(size))():
            return status, b""
        if size.value > most:
            return ENDING, b""
        data = ctypes.create_string_buffer(size.value)
        return self._bound("SerializeFMUState", state, data, size)(), data.raw

    def deserialise(self, data: bytes, state: ctypes.c_void_p) -> int:
        """Make a kept state of bytes."""
        size = ctypes.c_size_t(len(data))
        return self._bound("DeserializeFMUState", data, size, ctypes.byref(state))()

    def end(self, *, terminate: bool) -> None:
        """Terminate and free the instance."""
        if self._component:
            if terminate:
                self._bound("Terminate")()
            self._bound("FreeInstance")()
            self._component.value = None


def _named(kind: str) -> str:
    return "Int64" if kind == "Enumeration" else kind
