"""News on its way to a port: each frame once, and what the sealer sends by itself."""

from __future__ import annotations

from collections.abc import Callable

from quadvis.machine.mailbox import Mailbox
from quadvis.realtime.outlet import Outlet


def news_of(box: Mailbox) -> Callable[[], bytes | None]:
    """Return a function that takes the newest frame out of an outbox once; then None until the next one."""
    last = 0

    def newest() -> bytes | None:
        nonlocal last
        found = box.newest(after=last)
        if found is None:
            return None
        last = found.stamp
        return found.payload

    return newest


class NewsOutlet(Outlet):
    """Sends each frame once, as soon as it is due after it came; nothing once frames must be safe."""

    def has_its_farewell(self, frames: int) -> bool:
        """Return True: there is none."""
        return True

    def serve(self, now: int, *, safe: bool) -> None:
        """Send what is new."""
        if self._opened is None or now < self.due or not self._settles(now):
            return
        self.due = now + self.port.interval
        if safe:
            return
        with self._named():
            if self._rest or self._opened.unsent():
                self._write(self._rest, now)
                return
            self._refused = 0  # a port with nothing to send is not stuck
            self._write(self._sealed(self._newest() or b"", now), now)
