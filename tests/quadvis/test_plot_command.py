"""`quadvis plot`: chosen signals, one over another, several logs, other figures, other kinds of files."""

from __future__ import annotations

import re
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.cli import main
from quadvis.output.overlay import short_names

Sheets = list[Any]
Captured = pytest.CaptureFixture[str]
HEAD = b"\x89PNG\r\n"

PART = """
quadvis: 1
name: turn
params: {rate: 1 rad/s}
ports: {in: [], out: {place: both.y, angle: clock.y}}
blocks:
  clock: {block: sources.ramp, with: {slope: $rate}}
  one: {block: math.function, with: {function: cos}, in: {u: clock.y}}
  two: {block: math.function, with: {function: sin}, in: {u: clock.y}}
  both: {block: signal.concatenate, in: {u: [one.y, two.y]}}
"""
DIAGRAM = """
quadvis: 1
name: circle
params: {level: 0.5}
rates: {fast: 20 Hz}
stop_time: 6 s
blocks:
  turn: {part: turn.yaml, slot: true, rate: fast}
figures:
  - {title: Place, signals: turn.place, reference: $level}
variants:
  other:
    slots:
      turn: {part: other.yaml, rate: fast}
"""
OTHER = PART.replace("both", "pair").replace("two", "second").replace("1 rad/s", "2 rad/s")


@pytest.fixture
def sheets(monkeypatch: pytest.MonkeyPatch) -> Sheets:
    """Collect what matplotlib is asked to save."""
    figure = pytest.importorskip("matplotlib.figure").Figure
    found: Sheets = []
    save: Callable[..., None] = figure.savefig

    def keep(sheet: Any, *arguments: Any, **options: Any) -> None:
        found.append(sheet)
        save(sheet, *arguments, **options)

    monkeypatch.setattr(figure, "savefig", keep)
    return found


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a diagram and the logs of both variants."""
    folder = tmp_path_factory.mktemp("circle")
    for name, text in (("turn", PART), ("other", OTHER), ("circle", DIAGRAM)):
        (folder / f"{name}.yaml").write_text(text)
    for name, variant in (("one", None), ("two", "other")):
        quadvis.load(folder / "circle.yaml", variant=variant).run(log=folder / f"{name}.mcap")
    return folder


@pytest.fixture(autouse=True)
def there(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(made)


def legend(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_chosen_signals_have_a_panel_for_each_dimension(sheets: Sheets, capsys: Captured) -> None:
    assert main(["plot", "one.mcap", "--signals", "turn.place[0,], turn.angle", "-o", "x.png"]) == 2
    assert main(["plot", "one.mcap", "--signals", "turn.place, turn.angle", "-o", "chosen.png"]) == 0
    assert capsys.readouterr().out == "chosen.png\n"
    assert Path("chosen.png").read_bytes().startswith(HEAD)
    (sheet,) = sheets
    assert sheet.get_suptitle() == "turn.place, turn.angle"
    assert [legend(axes) for axes in sheet.axes] == [["turn.place[0]", "turn.place[1]"], ["turn.angle"]]
    assert [axes.get_ylabel() for axes in sheet.axes] == ["", "rad"]


def test_one_signal_over_another_is_a_path(sheets: Sheets) -> None:
    words = ["--signals", "turn.place[1]", "--against", "turn.place[0]"]
    assert main(["plot", "one.mcap", *words, "-o", "path.png"]) == 0
    (axes,) = sheets[0].axes
    (line,) = axes.get_lines()
    x, y = line.get_xdata(), line.get_ydata()
    assert len(x) == 121
    np.testing.assert_allclose(np.hypot(x, y), 1.0, atol=1e-12)
    assert (axes.get_xlabel(), legend(axes)) == ("turn.place[0]", ["turn.place[1]"])


def test_two_logs_lie_over_each_other_with_their_difference(sheets: Sheets) -> None:
    """The blocks of the variants have other names; what their parts give belongs together."""
    assert main(["plot", "one.mcap", "two.mcap", "-o", "both.pdf"]) == 0
    assert Path("both.pdf").read_bytes().startswith(b"%PDF-")
    both, less = sheets[0].axes
    assert [re.sub(r"\s+(RMS.*)?", " ", label).strip() for label in legend(both)] == [
        "turn/both.y[0] (one)",
        "turn/both.y[1] (one)",
        "turn/both.y[0] (two)",
        "turn/both.y[1] (two)",
    ]
    lines = both.get_lines()[:4]
    assert [line.get_color() for line in lines[:2]] == [line.get_color() for line in lines[2:]]
    assert lines[0].get_linestyle() != lines[2].get_linestyle()
    assert less.get_legend().get_title().get_text() == "two less one"
    first = less.get_lines()[0]
    times, values = first.get_xdata()[:-1], first.get_ydata()[:-1]
    np.testing.assert_allclose(values, np.cos(2 * times) - np.cos(times), atol=1e-9)


def test_three_logs_have_no_difference(sheets: Sheets) -> None:
    Path("sub").mkdir(exist_ok=True)
    Path("sub/one.mcap").write_bytes(Path("one.mcap").read_bytes())
    logs = ["one.mcap", "two.mcap", "sub/one.mcap"]
    assert main(["plot", *logs, "--signals", "turn.angle", "-o", "three.svg"]) == 0
    assert b"<svg" in Path("three.svg").read_bytes()
    (axes,) = sheets[0].axes
    assert len(axes.get_lines()) == 3


@pytest.mark.parametrize("kind", ["svg", "pdf", "png"])
def test_equal_figures_make_equal_files(kind: str) -> None:
    found = []
    for name in ("a", "b"):
        assert main(["plot", "one.mcap", "-o", f"{name}.{kind}"]) == 0
        found.append(Path(f"{name}.{kind}").read_bytes())
    assert found[0] == found[1]


@pytest.mark.parametrize(
    "text",
    [
        DIAGRAM.replace("title: Place", "title: Renamed"),
        "figures:\n  - {title: Renamed, signals: turn.place, reference: 0.5}\n",
    ],
    ids=["a diagram", "figures alone"],
)
def test_the_figures_of_another_file_replace_those_of_the_log(text: str, sheets: Sheets) -> None:
    Path("figures.yaml").write_text(text)
    assert main(["plot", "one.mcap", "--figures", "figures.yaml", "-o", "renamed.png"]) == 0
    assert sheets[0].get_suptitle() == "Renamed"
    level = sheets[0].axes[0].get_lines()[-1]
    assert set(level.get_ydata()) == {0.5}


def test_a_panel_of_a_diagram_may_be_a_path(sheets: Sheets) -> None:
    text = DIAGRAM.replace(
        "signals: turn.place, reference", 'signals: "turn.place[1]", against: "turn.place[0]", reference'
    )
    Path("plane.yaml").write_text(text)
    assert main(["plot", "one.mcap", "--figures", "plane.yaml", "-o", "plane.png"]) == 0
    assert sheets[0].axes[0].get_xlabel() == "turn/both.y[0]"
    diagram = quadvis.load("plane.yaml")
    diagram.run(log="plane.mcap")
    assert main(["plot", "plane.mcap", "-o", "again.png"]) == 0
    assert sheets[1].axes[0].get_xlabel() == sheets[0].axes[0].get_xlabel()


def test_what_was_drawn_is_shown(monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda place: opened.append(place) or True)
    assert main(["plot", "one.mcap", "-o", "shown.png", "--show"]) == 0
    assert opened == [Path("shown.png").resolve().as_uri()]
    monkeypatch.setattr(webbrowser, "open", lambda place: False)
    assert main(["plot", "one.mcap", "-o", "shown.png", "--show"]) == 2
    assert "nothing here can show 'shown.png'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--signals", "turn.plase"], "did you mean 'turn.place'?"),
        (["--signals", "turn.angle", "--against", "turn.place"], "'turn/both.y' has 2 elements; name one"),
        (["--against", "turn.angle"], "add what goes up, with --signals"),
        (["--figures", "none.yaml"], "none.yaml: there is no such file"),
        (["--figures", "turn.yaml"], "this is a part of a diagram"),
        (["--signals", "turn.angle", "-o", "turn.yaml"], "turn.yaml"),
    ],
)
def test_what_cannot_be_drawn_gets_a_sentence(words: list[str], sentence: str, capsys: Captured) -> None:
    assert main(["plot", "one.mcap", *words]) == 2
    assert sentence in capsys.readouterr().err


def test_a_file_of_one_picture_takes_one_figure(capsys: Captured) -> None:
    Path("more.yaml").write_text(
        "figures:\n  - {title: A, signals: turn.angle}\n  - {title: B, signals: turn.angle}\n"
    )
    assert main(["plot", "one.mcap", "--figures", "more.yaml", "-o", "more.svg"]) == 2
    assert "'more.svg' holds one figure, and there are 2" in capsys.readouterr().err
    assert main(["plot", "one.mcap", "--figures", "more.yaml", "-o", "more.pdf"]) == 0


def test_times_take_one_log(capsys: Captured) -> None:
    assert main(["plot", "one.mcap", "two.mcap", "--times"]) == 2
    assert "--times takes one log" in capsys.readouterr().err


def test_names_tell_logs_apart() -> None:
    paths = [Path("a/x.mcap"), Path("b/x.mcap"), Path("b/y.mcap")]
    assert short_names(paths) == ["a/x", "b/x", "b/y"]
    assert short_names(paths[1:]) == ["x", "y"]
    assert short_names([Path("x.mcap")] * 2) == ["x", "x"]
    assert short_names([]) == []
