"""One output port in the hands of the guardian: frames at the device's rate, written without waiting."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from quadvis.block import NewsDevice, Output, Sealer
from quadvis.machine.ports import ChannelError, OpenPort, PortError, PortSettings
from quadvis.realtime.schedule import NANOSECONDS

STUCK = NANOSECONDS  # ns after which a port that takes no bytes counts as lost


@dataclass(frozen=True)
class OutputPort:
    """What the guardian knows of an output device: bytes and times, no code but that of the ``sealer``.

    ``path`` is the port, ``interval`` the time from one frame to the next (ns); ``initial`` and ``safe`` are
    whole frames. ``beginning`` and ``ending`` are sent once, before and after all frames. After safe frames
    for the time ``held`` (ns) none follow; 0 means that there is no such time. ``news`` are sent once each,
    and have none of these. A ``shared`` port has other outlets, too.
    """

    block: str
    path: str
    settings: PortSettings
    interval: int
    initial: bytes
    safe: bytes
    sealer: Sealer | None = None
    beginning: bytes = b""
    ending: bytes = b""
    held: int = 0
    news: bool = False
    shared: bool = False

    @property
    def parting(self) -> int:
        """How long (ns) its last safe frames may take to begin, or to end: it may be starting, or be held."""
        return round(NANOSECONDS * self.settings.settle) + self.held

    @staticmethod
    def of(device: Output | NewsDevice, block: str, path: str, shared: bool = False) -> OutputPort:
        """Return the port of a device."""
        settings, interval = device.settings, round(device.interval * NANOSECONDS)
        if isinstance(device, NewsDevice):
            sealer = device.sealer()
            return OutputPort(block, path, settings, interval, b"", b"", sealer, news=True, shared=shared)
        return OutputPort(
            block,
            path,
            settings,
            interval,
            device.initial_frame(),
            device.safe_frame(),
            device.sealer(),
            device.beginning(),
            device.ending(),
            round(device.held * NANOSECONDS),
            shared=shared,
        )


class Outlet:
    """Sends frames to a port, one every interval on a grid of its own; PortError if the port is lost.

    Whatever else a driver raises is such an error, too, so that it keeps no other port from its frames.
    ``newest`` returns the newest frame; None before the first one, or if it cannot be read now. ``open_port``
    opens the port if its settings do not.
    """

    def __init__(
        self,
        port: OutputPort,
        newest: Callable[[], bytes | None],
        open_port: Callable[[], OpenPort] | None = None,
    ) -> None:
        self.port, self._newest, self._open_port = port, newest, open_port
        self._frame = port.initial
        self._opened: OpenPort | None = None
        self._beginning = port.beginning
        self._settled = False  # whether the device has had the time to start
        self._rest = b""  # of what the port has taken in part
        self._free = 0  # the instant from which the line can take a frame
        self.due = 0  # the instant of the next frame
        self._refused = 0  # the instant from which on the port has taken no bytes; 0 if it takes them
        self._safe_since = 0  # the instant of the first safe frame; 0 if the newest frame was none
        self._released = False
        self.safe_frames = 0  # how many safe frames were sent

    @property
    def is_open(self) -> bool:
        """True if the port is open."""
        return self._opened is not None

    def open(self) -> None:
        """Open the port."""
        opens = self._open_port
        with self._foreign():
            self._opened = self.port.settings.open(self.port.path) if opens is None else opens()

    def close(self) -> None:
        """Close the port."""
        opened, self._opened = self._opened, None
        if opened is not None:
            with suppress(Exception):  # of a driver: there is nothing more to be sent
                opened.close()

    def finish(self, now: int) -> None:
        """Send what comes after all frames, and close the port."""
        with suppress(PortError), self._foreign():
            self._release(now)
        self.close()

    def hurry(self, now: int) -> None:
        """Make the next frame due as soon as the line can take it."""
        self.due = max(now, self._free)

    def has_its_farewell(self, frames: int) -> bool:
        """Return whether so many safe frames were sent, or those of the time for which it is held."""
        if not self.is_open or self._released:
            return True
        return not self.port.held and self.safe_frames >= frames

    def serve(self, now: int, *, safe: bool) -> None:
        """Send what is due: the safe frame, or the newest, or before the first one the initial frame."""
        if self._opened is None or now < self.due or not self._settles(now):
            return
        self._frame = self._newest() or self._frame
        interval = self.port.interval
        self.due += interval if now < self.due + interval else interval * (1 + (now - self.due) // interval)
        with self._named():
            if self._rest or self._opened.unsent():
                ends = bool(self._rest)
                self._write(self._rest, now)
                if safe and ends and not self._rest:
                    self.hurry(now)  # the safe frame comes right behind the end of the one before
            elif self._beginning:
                piece, self._beginning = self._beginning, b""
                self._write(piece, now)
                self.hurry(now)
            elif safe:
                self._send_safe(now)
            else:
                self._safe_since, self._released = 0, False
                self._write_frame(self._frame, now)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Name the port in what goes wrong with it."""
        try:
            with self._foreign():
                yield
        except PortError as error:
            raise type(error)(f"{self.port.path}: {error}") from error

    @contextmanager
    def _foreign(self) -> Iterator[None]:
        """Let any other error of a driver be one of the port."""
        try:
            yield
        except PortError:
            raise
        except Exception as error:
            raise PortError(f"the driver has failed: {type(error).__name__}: {error}") from error

    def _settles(self, now: int) -> bool:
        """Return whether the device has had the time to start; else the first frame is due when it has."""
        if not self._settled:
            self._settled = True
            self._free = now + round(NANOSECONDS * self.port.settings.settle)
            self.hurry(now)
        return now >= self.due

    def _send_safe(self, now: int) -> None:
        self._safe_since = self._safe_since or now
        if self.port.held and now - self._safe_since >= self.port.held:
            self._release(now)
            return
        try:
            self.safe_frames += self._write_frame(self.port.safe, now)
        except ChannelError:  # the other channels have it
            self.safe_frames += 1
            raise

    def _release(self, now: int) -> None:
        """Send what comes after all frames, once."""
        if self._opened is not None and not self._released:
            self._released = True
            ending = self._sealed(self.port.ending, now) if self.port.ending else b""
            self._write(self._rest + ending, now)

    def _sealed(self, frame: bytes, now: int) -> bytes:
        sealer = self.port.sealer
        try:
            return frame if sealer is None else sealer.seal(frame, now)
        except Exception as error:
            raise PortError(f"a frame cannot be sealed: {error}") from error

    def _write_frame(self, frame: bytes, now: int) -> bool:
        """Write a frame; return whether all of it was taken.

        One of which nothing was taken is dropped: the next one is newer, or safe.
        """
        sealed = self._sealed(frame, now)
        self._write(sealed, now)
        is_taken = not self._rest
        if len(self._rest) == len(sealed):
            self._rest = b""
        return is_taken

    def _write(self, piece: bytes, now: int) -> None:
        """Write as much as the port takes at once."""
        assert self._opened is not None
        count = self._opened.write(piece) if piece else 0
        self._rest = piece[count:]
        if count:
            self._refused = 0
            settings = self.port.settings
            taken = settings.time(count) + (0.0 if self._rest else settings.gap)
            self._free = now + int(NANOSECONDS * taken)
        elif not self._refused:
            self._refused = now
        elif now - self._refused > STUCK:
            raise PortError("the port takes no bytes")
