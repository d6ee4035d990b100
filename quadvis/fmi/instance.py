"""An instance of an FMU in this process: its library loaded, and requests done over an exchange's buffer.

Only the standard library is needed here, so that a process that isolates an FMU begins soon.
"""

from __future__ import annotations

import ctypes
import os
import struct
from collections.abc import Callable
from typing import Any

from quadvis.fmi.calls2 import Calls2
from quadvis.fmi.calls3 import Calls3
from quadvis.fmi.exchange import (
    COMPLETE,
    DISCARD,
    ENDING,
    ERROR,
    FORGET,
    FORMATS,
    GET,
    LENGTH,
    NO_INSTANCE,
    NO_LIBRARY,
    NUMBER,
    OK,
    RESTORE,
    SAVE,
    SET_GET,
    SLOPES,
    STEP,
    STEP_ON,
    TEXT,
    TEXT_ROOM,
    TIME,
    TUNE,
    WARNING,
    FixedValues,
    UnitSetup,
    ValueGroup,
)
from quadvis.fmi.messages import Messages

Call = Callable[[], int]
TYPES: dict[str, Any] = {
    "d": ctypes.c_double, "f": ctypes.c_float, "b": ctypes.c_int8, "B": ctypes.c_uint8, "h": ctypes.c_int16,
    "H": ctypes.c_uint16, "i": ctypes.c_int32, "I": ctypes.c_uint32, "q": ctypes.c_int64,
    "Q": ctypes.c_uint64, "?": ctypes.c_bool,
}  # fmt: skip
MOST_STATE = 256_000_000  # bytes of a state of an FMU
NEVER = "the library has not what its description promises: "


class FmuInstance:
    """An FMU, run by one thread. `open` loads and initialises it; `perform` does one of its ``requests``.

    Each returns a status as in ``quadvis.fmi.exchange``; what the FMU says about it is in the buffer.
    """

    def __init__(self, setup: UnitSetup, buffer: Any, folder: str) -> None:
        self._setup, self._buffer, self._folder = setup, buffer, folder
        self._messages = Messages()
        self._calls: Calls2 | Calls3 | None = None
        self._ready = False
        self.requests: dict[int, Call] = {}
        self._kept: dict[int, ctypes.c_void_p] = {}
        self._counted = 0

    def open(self) -> int:
        """Load the library, make the instance, initialise it, and get its outputs."""
        setup = self._setup
        try:
            library = ctypes.CDLL(setup.library, mode=os.RTLD_NOW | os.RTLD_LOCAL)
        except OSError as error:
            return self._say(NO_LIBRARY, str(error).removeprefix(f"{setup.library}: "))
        made = Calls2 if setup.version == 2 else Calls3
        calls = self._calls = made(library, setup, self._messages)
        try:
            if not calls.instantiate():
                return self._say(NO_INSTANCE)
            for step in (*map(self._fixed, setup.fixed), calls.enter_initialisation, *self._tuned()):
                if status := self._judged(step()):
                    return status
            if status := self._judged(calls.exit_initialisation()):
                return status
            self._ready = True
            if setup.states is not None and (status := self._judged(self._begin_continuous())):
                return status
            self._bind(calls)
        except AttributeError as error:
            return self._say(NO_LIBRARY, f"{NEVER}{str(error).rpartition(': ')[2]}")
        return self.perform(GET)

    def perform(self, request: int) -> int:
        """Do a request."""
        status = self.requests[request]()
        return self.judged(request, status) if status else OK

    def judged(self, request: int, status: int) -> int:
        """Return what the status of a request means."""
        return self._discarded() if status == DISCARD and request == STEP_ON else self._judged(status)

    def end(self) -> None:
        """End the instance; what an FMU does then is its own business."""
        if self._calls is not None:
            for state in self._kept.values():
                self._calls.forget(state)
            self._kept.clear()
            self._calls.end(terminate=self._ready)
            self._calls = None

    def _discarded(self) -> int:
        """Return what the status Discard of a step means; an FMU may ask to end after a whole step."""
        assert self._calls is not None
        time, step = struct.unpack_from("2d", self._buffer, TIME)
        if status := self._calls.discarded(time + step):
            return self._judged(status)
        self.requests[STEP_ON] = lambda: ENDING
        return self.perform(GET)

    def _judged(self, status: int) -> int:
        """Return a status that counts, with what the FMU has said about it."""
        return self._say(status) if self._counts(status) else OK

    def _counts(self, status: int) -> bool:
        return status != OK and not (status == WARNING and self._setup.warnings)

    def _say(self, status: int, text: str = "") -> int:
        """Put a text, or what the FMU has said, into the buffer."""
        words = (text or self._messages.text()).encode()[:TEXT_ROOM]
        self._messages.clear()
        struct.pack_into("q", self._buffer, LENGTH, len(words))
        self._buffer[TEXT : TEXT + len(words)] = words
        return status

    def _all(self, *calls: Call) -> Call:
        """Return a call of several; the first status that counts ends it."""
        if len(calls) == 1:
            return calls[0]
        if len(calls) == 3 and not self._setup.warnings:  # most steps: one setter and one getter
            first, second, third = calls
            return lambda: first() or second() or third()

        def call() -> int:
            for each in calls:
                status = each()
                if status and self._counts(status):
                    return status
            return OK

        return call

    def _array(self, section: ValueGroup) -> Any:
        kind = TYPES[FORMATS[self._setup.version][section.kind]]
        return (kind * section.size).from_buffer(self._buffer, section.offset)

    def _fixed(self, values: FixedValues) -> Call:
        """Return the call that sets values once."""
        assert self._calls is not None
        if values.kind == "String":
            array: Any = (ctypes.c_char_p * len(values.values))(*(text.encode() for text in values.values))
        else:
            kind = TYPES[FORMATS[self._setup.version][values.kind]]
            array = (kind * len(values.values))(*values.values)
        return self._calls.setter(values.kind, values.references, array)

    def _tuned(self) -> list[Call]:
        assert self._calls is not None
        return [
            self._calls.setter(each.kind, each.references, self._array(each)) for each in self._setup.tunable
        ]

    def _begin_continuous(self) -> int:
        calls, setup = self._calls, self._setup
        assert calls is not None and setup.states is not None
        if status := calls.begin_continuous():
            return status
        if not setup.states:
            return OK
        return calls.state_getter(self._doubles(setup.states_at, setup.states), setup.states)()

    def _doubles(self, offset: int, count: int) -> Any:
        return (ctypes.c_double * count).from_buffer(self._buffer, offset)

    def _bind(self, calls: Calls2 | Calls3) -> None:
        """Bind the calls of each request to the buffer."""
        setup = self._setup
        time, step = (ctypes.c_double.from_buffer(self._buffer, place) for place in (TIME, STEP))
        sets = [calls.setter(each.kind, each.references, self._array(each)) for each in setup.inputs]
        gets = [calls.getter(each.kind, each.references, self._array(each)) for each in setup.outputs]
        if setup.states is None:
            found = {
                STEP_ON: self._all(*sets, calls.stepper(time, step), *gets),
                GET: self._all(*gets),
                SET_GET: self._all(*sets, *gets),
            }
        else:
            count = setup.states
            place = [calls.time_setter(time)]
            if count:
                place.append(calls.state_setter(self._doubles(setup.states_at, count), count))
            place += sets
            slopes = [calls.slope_getter(self._doubles(setup.slopes_at, count), count)] if count else []
            complete = [calls.completer()] if setup.completed_step else []
            found = {
                GET: self._all(*gets),
                SET_GET: self._all(*place, *gets),
                SLOPES: self._all(*place, *slopes),
                COMPLETE: self._all(*place, *complete),
            }
        found |= {
            TUNE: self._all(*self._tuned()),
            SAVE: self._save,
            RESTORE: self._restore,
            FORGET: self._forget,
        }
        self.requests = found

    def _save(self) -> int:
        """Keep the state: as bytes in a file if the FMU can, else in memory of the FMU, by a number."""
        assert self._calls is not None
        state = ctypes.c_void_p()
        if status := self._calls.save(state):
            return status
        if not self._setup.serialises:
            self._counted += 1
            self._kept[self._counted] = state
            struct.pack_into("q", self._buffer, NUMBER, self._counted)
            return OK
        status, data = self._calls.serialised(state, MOST_STATE)
        self._calls.forget(state)
        if status:
            return status
        with open(self._state_file, "wb") as file:
            file.write(data)
        return OK

    def _restore(self) -> int:
        """Go back to a state that was kept."""
        assert self._calls is not None
        if not self._setup.serialises:
            (number,) = struct.unpack_from("q", self._buffer, NUMBER)
            return self._calls.restore(self._kept[number]) if number in self._kept else ERROR
        with open(self._state_file, "rb") as file:
            data = file.read()
        state = ctypes.c_void_p()
        if status := self._calls.deserialise(data, state):
            return status
        status = self._calls.restore(state)
        self._calls.forget(state)
        return status

    def _forget(self) -> int:
        assert self._calls is not None
        (number,) = struct.unpack_from("q", self._buffer, NUMBER)
        state = self._kept.pop(number, None)
        return OK if state is None else self._calls.forget(state)

    @property
    def _state_file(self) -> str:
        return os.path.join(self._folder, "state")
