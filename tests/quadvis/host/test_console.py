from collections.abc import Iterator, Sequence

import pytest

from quadvis.cli.console import run_console


class Bench:
    """A target that notes what it is asked for."""

    name = "bench"
    Application = "loop"

    def __init__(self) -> None:
        self.done: list[str] = []

    def stop(self) -> None:
        self.done.append("stop")

    def status(self) -> dict[str, object]:
        return {"Application": "loop", "ExecTime": 1.0}


@pytest.mark.parametrize(
    ("line", "done", "said"),
    [
        ("stop", ["stop"], ""),
        ("stop --target bench", ["stop"], ""),
        (
            "stop --target lab2",
            [],
            "this console is that of bench; leave --target out, or open another console",
        ),
        ('set law.factor="3', [], "a quotation mark or a backslash has no other half; write it in pairs"),
        ("set law.factor=3\\", [], "a quotation mark or a backslash has no other half; write it in pairs"),
        ("fly", [], "write one of load, start, stop"),
    ],
)
def test_a_line_is_for_the_target_of_the_console(
    line: str,
    done: Sequence[str],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    lines: Iterator[str] = iter([line, "exit"])
    monkeypatch.setattr("builtins.input", lambda _: next(lines))
    bench = Bench()
    assert run_console(bench) == (2 if said else 0)  # type: ignore[arg-type]
    assert bench.done == done
    assert said in capsys.readouterr().err
