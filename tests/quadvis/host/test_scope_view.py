from collections.abc import Iterator
from typing import Any

import pytest

from quadvis.cli.scope_view import live


class Waiting:
    """A target on which nothing runs until the person who looks gives up; its own scope."""

    name = "bench"

    def __init__(self, status: str) -> None:
        self._status, self.is_removed = status, False

    def addscope(self, *_: Any, **__: Any) -> "Waiting":
        return self

    def start(self) -> None:
        """Acquire nothing."""

    def status(self) -> dict[str, str]:
        return {"Status": self._status}

    def packages(self, timeout: float) -> Iterator[Any]:
        raise KeyboardInterrupt
        yield

    def remove(self) -> None:
        self.is_removed = True


@pytest.mark.parametrize(
    ("status", "said"),
    [("stopped", "bench runs no application: waiting for one, until Ctrl-C\n"), ("running", "")],
)
def test_a_live_scope_says_that_nothing_runs(
    status: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    bench = Waiting(status)
    live(bench, ["wave.y"], {"NumSamples": 20})  # type: ignore[arg-type]
    assert capsys.readouterr().err == said
    assert bench.is_removed
