"""Figures: the declared signals are on the axes, in their units; impossible figures are refused."""

from __future__ import annotations

import itertools
import math
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from quadvis import load
from quadvis.diagram.sections.figures import FigureReader, read_figures
from quadvis.errors import DiagramError, Faults, QuadvisError
from quadvis.graph.graph import Wire
from quadvis.graph.names import read_name
from quadvis.output.figures import Figure, Panel, Trace, block_figures
from quadvis.output.log import LogWriter
from quadvis.output.log_reader import read_log
from quadvis.output.plot import plot_figures, plot_logs
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.units import Unit
from tests.stages import mostly_slow

Sheets = list[Any]

HOVER = """
quadvis: 1
name: hover
figures:
  - title: Position estimate
    from: 40 s
    to: 140 s
    panels:
      - title: x
        signals:
          - plant.position[0]
          - {signal: "vision/pose.position[0]", label: camera}
        unit: cm
        reference: 0
      - {title: y, signals: "plant.position[1]", unit: cm, reference: 0 m}
  - title: Yaw angle
    from: 40 s
    signals: plant.yaw
    unit: deg
  - title: Control inputs
    panels:
      - {title: roll, signals: roll.torque}
      - {title: yaw, signals: yaw.torque}
      - {title: pitch, signals: pitch.torque}
"""


CENTIMETRE = Unit.parse("cm")


def trace(text: str, label: str = "") -> Trace:
    """Return the trace of a signal by its name."""
    wire = read_name(text)
    assert wire is not None
    return Trace(wire, label)


def plotted_log(path: Path, output: Path | None = None) -> list[Path]:
    """Draw a log as `quadvis plot` does."""
    log = read_log(path)
    return plot_logs([log], read_figures(log.diagram, f"{log.path}: diagram"), output)


class Run:
    """A recorded run that is no log: sines of known amplitude (m, rad, N*m) over 150 s."""

    def __init__(self) -> None:
        self.signals: dict[str, tuple[NDArray[np.float64], NDArray[Any], str]] = {}
        fast, slow = np.arange(0, 150, 0.01), np.arange(0, 150, 0.1)
        circle = np.stack([0.1 * np.sin(fast), 0.2 * np.cos(fast), 1.5 + 0 * fast], axis=1)
        self.signals["plant.position"] = fast, circle, "m"
        self.signals["plant.yaw"] = fast, np.full(len(fast), math.pi / 180), "rad"
        self.signals["plant.state"] = fast, np.ones((len(fast), 3)), "m m rad"
        self.signals["vision/pose.position"] = slow, 0.1 * np.sin(slow)[:, None] * np.ones(3), "m"
        self.signals["vision/detector.found"] = slow, slow > 1, "1"
        self.signals["vision/detector.centres"] = (
            slow,
            np.arange(8.0).reshape(4, 2) + np.zeros((len(slow), 4, 2)),
            "px",
        )
        for axis in ("roll", "yaw", "pitch"):
            self.signals[f"{axis}.torque"] = slow, 0.02 * np.sin(slow), "N*m"

    @property
    def units(self) -> dict[str, str]:
        """The unit of every signal."""
        return {name: unit for name, (_, _, unit) in self.signals.items()}

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the rows of a signal."""
        return self.signals[name][1]

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times of its rows."""
        return self.signals[name][0]

    def rate(self, name: str) -> str:
        """Return the rate of its block: the plant is continuous, all else is sampled."""
        return "continuous" if name.startswith("plant.") else "vision"

    def write(self, path: Path, diagram: str) -> None:
        """Log the run."""
        names = list(self.signals)
        kinds = {"b": "bool", "f": "float64"}
        channels = []
        for name in names:
            block, _, port = name.rpartition(".")
            kind = kinds[self[name].dtype.kind]
            fields = (RecordedPort(port, kind, self[name].shape[1:], self.units[name]),)
            channels.append(RecordedBlock(f"/{block}", fields, self.rate(name)))
        with LogWriter(path, channels, {"diagram": diagram}) as log:
            for index, name in enumerate(names):
                stamps = np.round(self.times(name) * 1e9).astype(np.int64)
                slot = np.int64 if self[name].dtype == bool else np.float64
                rows = self[name].astype(slot).reshape(len(stamps), -1)
                log.write_rows(index, stamps, rows.view(np.int64))


@pytest.fixture(scope="module")
def run() -> Run:
    """Return a run of 150 s."""
    return Run()


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


def legend(axes: Any) -> list[str]:
    """Return the entries of a legend."""
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_a_log_is_drawn_as_its_diagram_declares(run: Run, sheets: Sheets, tmp_path: Path) -> None:
    run.write(tmp_path / "flight.mcap", HOVER)
    paths = plotted_log(tmp_path / "flight.mcap", tmp_path / "out")
    assert [path.name for path in paths] == [
        "1-position-estimate.png",
        "2-yaw-angle.png",
        "3-control-inputs.png",
    ]
    position, yaw, control = sheets
    assert [sheet.get_suptitle() for sheet in sheets] == ["Position estimate", "Yaw angle", "Control inputs"]
    assert [len(sheet.axes) for sheet in sheets] == [2, 1, 3]
    x, y = position.axes
    assert [axes.get_legend().get_title().get_text() for axes in control.axes] == ["roll", "yaw", "pitch"]
    assert (x.get_xlim(), x.get_xlabel(), x.get_ylabel()) == ((40, 140), "time (s)", "cm")
    # A sine of 10 cm has an RMS of 10/sqrt(2) cm; what is left of a period changes little.
    assert [text.split("   RMS ")[0] for text in legend(x)] == ["plant.position[0]", "camera"]
    assert [float(text.split("RMS ")[1].split(" ")[0]) for text in legend(x)] == pytest.approx(
        [7.07, 7.07], abs=0.1
    )
    plotted = y.get_lines()[0]
    assert np.allclose(plotted.get_ydata(), 20 * np.cos(plotted.get_xdata()), atol=1e-9)
    assert plotted.get_xdata()[[0, -1]] == pytest.approx([40, 140], abs=0.011)
    assert legend(yaw.axes[0]) == ["plant.yaw"]
    assert control.axes[0].get_ylabel() == "N\u00b7m"


def test_pictures_are_png_files_of_a_readable_size(run: Run, tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2")
    figures = [
        Figure("One", (Panel((trace("plant.yaw"),)),)),
        Figure("Three", (Panel((trace("plant.yaw"),)),) * 3),
    ]
    one, three = (cv2.imread(str(path)) for path in plot_figures(run, figures, tmp_path))
    assert one.shape[1] >= 900
    assert three.shape[1] > one.shape[1]
    assert one.min() < 100
    assert (one == 255).all(axis=2).mean() > 0.5


@pytest.mark.slow
def test_without_a_folder_pictures_lie_beside_the_log(run: Run, tmp_path: Path) -> None:
    run.write(tmp_path / "flight.mcap", HOVER)
    paths = plotted_log(tmp_path / "flight.mcap")
    assert {path.parent for path in paths} == {tmp_path / "flight-figures"}
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


@pytest.mark.slow
def test_without_declared_figures_every_block_is_drawn(run: Run, sheets: Sheets, tmp_path: Path) -> None:
    run.write(tmp_path / "flight.mcap", "quadvis: 1\nname: hover\n")
    paths = plotted_log(tmp_path / "flight.mcap")
    names = [path.name for path in paths]
    assert names == [
        "1-plant.png",
        "2-vision-pose.png",
        "3-vision-detector.png",
        "4-roll.png",
        "5-yaw.png",
        "6-pitch.png",
    ]
    plant = sheets[0].axes
    assert [axes.get_legend().get_title().get_text() for axes in plant] == [
        "position",
        "yaw",
        "state",
        "state",
    ]
    assert [axes.get_ylabel() for axes in plant] == ["m", "rad", "m", "rad"]
    assert [text.split(" ")[0] for text in legend(plant[2])] == ["state[0]", "state[1]"]
    assert len(sheets[2].axes[1].get_lines()) == 8


def test_truth_values_are_steps_without_an_rms(run: Run, sheets: Sheets, tmp_path: Path) -> None:
    plot_figures(run, [Figure("Found", (Panel((trace("vision/detector.found"),)),))], tmp_path)
    (line,) = sheets[0].axes[0].get_lines()
    assert line.get_drawstyle() == "steps-post"
    assert legend(sheets[0].axes[0]) == ["vision/detector.found"]


def test_the_rms_counts_from_the_reference(run: Run, sheets: Sheets, tmp_path: Path) -> None:
    panel = Panel((trace("plant.position[2]", "height"),), unit=CENTIMETRE, reference=147.0)
    plot_figures(run, [Figure("Height", (panel,))], tmp_path)
    assert legend(sheets[0].axes[0]) == ["height   RMS 3 cm"]
    assert sheets[0].axes[0].get_lines()[1].get_ydata() == [147.0, 147.0]


def test_without_a_reference_there_is_no_rms(run: Run, sheets: Sheets, tmp_path: Path) -> None:
    plot_figures(run, [Figure("Height", (Panel((trace("plant.position[2]"),)),))], tmp_path)
    assert legend(sheets[0].axes[0]) == ["plant.position[2]"]


def test_a_stretch_of_elements_gives_a_curve_each(run: Run, sheets: Sheets, tmp_path: Path) -> None:
    traces = (trace("vision/detector.centres[1:3,1]"), trace("vision/detector.centres[0,0]", "first"))
    plot_figures(run, [Figure("Centres", (Panel(traces),))], tmp_path)
    lines = sheets[0].axes[0].get_lines()
    assert [line.get_ydata()[0] for line in lines] == [3, 5, 0]
    assert [line.get_label().split("   ")[0] for line in lines] == [
        "vision/detector.centres[1,1]",
        "vision/detector.centres[2,1]",
        "first",
    ]


def test_a_run_that_ended_early_gives_an_empty_picture(run: Run, sheets: Sheets, tmp_path: Path) -> None:
    plot_figures(run, [Figure("Late", (Panel((trace("plant.yaw"),)),), start=200.0, stop=300.0)], tmp_path)
    assert [text.get_text() for text in sheets[0].axes[0].texts] == ["no samples"]


def test_missing_samples_do_not_spoil_the_rms(run: Run, sheets: Sheets, tmp_path: Path) -> None:
    holes = Run()
    times = np.arange(10.0)
    holes.signals["pose.x"] = times, np.where(times % 2 == 0, 3.0, math.nan), "m"
    plot_figures(holes, [Figure("Holes", (Panel((trace("pose.x"),), reference=0.0),))], tmp_path)
    assert legend(sheets[0].axes[0]) == ["pose.x   RMS 3 m"]


@pytest.mark.parametrize(
    ("panel", "sentence"),
    [
        (
            Panel((trace("plant.positon"),)),
            "there is no signal 'plant.positon'; did you mean 'plant.position'?",
        ),
        (
            Panel((trace("plant.position[3]"),)),
            "'plant.position[3]' does not exist; 'plant.position' has the shape [3]",
        ),
        (
            Panel((trace("plant.yaw[0]"),)),
            "'plant.yaw[0]' does not exist; 'plant.yaw' has one element and takes no index",
        ),
        (Panel((trace("plant.yaw"),), unit=CENTIMETRE), "'plant.yaw' is in rad, which cannot be shown in cm"),
        (
            Panel((trace("plant.yaw"), trace("roll.torque"))),
            "'roll.torque' is in N*m, which cannot be shown in rad",
        ),
        (Panel(()), "panel '' has no signals; name one"),
    ],
)
def test_what_cannot_be_drawn_is_a_sentence(run: Run, tmp_path: Path, panel: Panel, sentence: str) -> None:
    with pytest.raises(QuadvisError) as caught:
        plot_figures(run, [Figure("Yaw", (panel,))], tmp_path / "out")
    assert str(caught.value) == f"figure 'Yaw': {sentence}"
    assert not (tmp_path / "out").exists()


def test_all_unknown_signals_are_named_at_once(run: Run, tmp_path: Path) -> None:
    wrong = Panel((trace("nothing.here"),))
    with pytest.raises(QuadvisError) as caught:
        plot_figures(run, [Figure("A", (wrong, wrong)), Figure("B", (wrong,)), Figure("C", ())], tmp_path)
    lines = str(caught.value).splitlines()
    assert [line.partition(":")[0] for line in lines[:3]] == ["figure 'A'", "figure 'A'", "figure 'B'"]
    assert lines[3] == "figure 'C' has no panels; give it signals"


def test_a_folder_that_cannot_be_made_is_a_sentence(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(QuadvisError, match=r"cannot write figures to '.*file': file exists"):
        plot_figures(run, block_figures(run), tmp_path / "file")


def read(text: str) -> tuple[list[Figure], list[str]]:
    """Read the text under `figures:`; return the figures, and the faults without their file."""
    from quadvis.document import parse_yaml

    faults = Faults()
    figures = FigureReader(faults).figures(parse_yaml(text, "d.yaml"))
    return figures, [str(fault).removeprefix("d.yaml:") for fault in faults]


def test_figures_are_read_with_their_defaults() -> None:
    text = """
    - title: Yaw
      signals: plant.yaw
    - title: Height
      to: 20 s
      panels:
        - signals: ["plant.position[2]", {signal: guide.height, label: wanted}]
          unit: cm
          reference: 1.5 m
    """
    figures, faults = read(text)
    assert not faults
    assert figures[0] == Figure("Yaw", (Panel((trace("plant.yaw"),)),))
    traces = (trace("plant.position[2]"), trace("guide.height", "wanted"))
    assert figures[1] == Figure("Height", (Panel(traces, "", CENTIMETRE, 150.0),), stop=20.0)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("[{titel: Yaw, signals: a.b}]", "1:3: key 'titel' is unknown; did you mean 'title'?"),
        ("[{title: Yaw}]", "1:2: key 'signals' is missing; add 'signals: ...'"),
        ("[{title: Yaw, signals: []}]", "1:24: the list is empty; write its entries, or leave the key out"),
        ("[{title: Yaw, panels: []}]", "1:23: the list is empty; write its entries, or leave the key out"),
        (
            "[{title: Yaw, signals: yaw}]",
            "1:24: 'yaw' is not a signal; write block.port, block.port[0] or part/block.port[0:2]",
        ),
        ("[{title: Yaw, signals: ['a.b[x]']}]", "1:25: 'a.b[x]' is not a signal"),
        ("[{title: Yaw, signals: a.b, unit: dog}]", "1:35: 'dog' is not a unit; did you mean 'deg'?"),
        (
            "[{title: Yaw, signals: a.b, unit: deg, reference: 1 m}]",
            "1:51: 'reference': '1 m' is in m, not in deg",
        ),
        ("[{title: Yaw, signals: a.b, from: 40}]", "1:35: 'from': '40' has no unit"),
        ("[{title: Yaw, signals: a.b, from: 9 s, to: 9 s}]", "1:44: 'to' must come after 'from'"),
        ("{title: Yaw}", "1:1: this must be a list"),
        ("[Yaw]", "must be a map"),
    ],
)
def test_wrong_figures_are_located(text: str, fault: str) -> None:
    _, faults = read(text)
    assert len(faults) == 1
    assert fault in faults[0]


def test_all_faults_of_the_figures_are_found_at_once() -> None:
    _, faults = read("[{title: A, signals: a}, {title: B, form: 1 s, panels: [{signals: b}, {signal: c.d}]}]")
    assert len(faults) == 4


def test_a_log_whose_diagram_is_damaged_names_the_place(run: Run, tmp_path: Path) -> None:
    run.write(tmp_path / "flight.mcap", HOVER.replace("unit: deg", "unit: dog"))
    with pytest.raises(DiagramError, match=r"flight\.mcap: diagram:19:11: .*did you mean 'deg'"):
        plotted_log(tmp_path / "flight.mcap")


@given(st.lists(st.one_of(st.integers(0, 99), st.tuples(st.integers(0, 99), st.integers(0, 99))), max_size=3))
def test_an_index_is_split_as_numpy_would_read_it(index: list[Any]) -> None:
    parts = [f"{part[0]}:{part[1]}" if isinstance(part, tuple) else str(part) for part in index]
    text = f"vision/detector.centres[{','.join(parts)}]" if parts else "vision/detector.centres"
    expected = tuple(slice(*part) if isinstance(part, tuple) else part for part in index)
    assert read_name(text) == Wire("vision/detector", "centres", expected)


@pytest.mark.parametrize(
    "text", ["", "plant", "a.b[", "a.b[]", "a.b[-1]", "a.b[1]c", "a.b[1 2]", "[0]", ".b", "a."]
)
def test_other_texts_are_no_signals(text: str) -> None:
    assert read_name(text) is None


STAIRS = """
quadvis: 1
name: stairs
rates: {c: 20 Hz, slow: 10 Hz, rare: 1/2 Hz, fast: 1 kHz}
solver: {method: ode4, step: 1 ms}
stop_time: 3 s
blocks:
  pulse: {block: sources.pulse, rate: c, with: {interval: 1 s}}
  reference: {block: sources.step, rate: slow, with: {at: 1 s}}
  rare: {block: sources.sine, rate: rare}
  fast: {block: sources.sine, rate: fast}
  truth: {block: sources.constant, rate: continuous, with: {value: 1}}
  lag: {block: signal.low_pass, rate: continuous, with: {time_constant: 0.2 s}, in: {u: truth.y}}
figures:
  - {title: All, signals: [pulse.y, reference.y, rare.y, fast.y, lag.y]}
  - {title: Late, signals: [rare.y, lag.y], from: 2.5 s, to: 2.9 s}
"""


@pytest.fixture
def stairs(sheets: Sheets, tmp_path: Path) -> Sheets:
    """Draw a run of blocks at several rates."""
    (tmp_path / "stairs.yaml").write_text(STAIRS)
    load(tmp_path / "stairs.yaml").run(log=tmp_path / "stairs.mcap")
    plotted_log(tmp_path / "stairs.mcap")
    return sheets


def test_sampled_signals_are_stairs_and_continuous_ones_lines(stairs: Sheets) -> None:
    lines = {line.get_label(): line for line in stairs[0].axes[0].get_lines()}
    drawn = {label: line.get_drawstyle() for label, line in lines.items()}
    held = dict.fromkeys(("pulse.y", "reference.y", "rare.y", "fast.y"), "steps-post")
    assert drawn == {**held, "lag.y": "default"}


@pytest.mark.parametrize(("time", "value"), [(0.93, 0.0), (0.99, 0.0), (1.0, 1.0), (1.01, 1.0)])
def test_a_step_is_drawn_when_it_happens(stairs: Sheets, time: float, value: float) -> None:
    (line,) = (line for line in stairs[0].axes[0].get_lines() if line.get_label() == "reference.y")
    times, values = line.get_path().vertices.T  # before stairs are made of them
    assert values[np.searchsorted(times, time, side="right") - 1] == value


def test_stairs_reach_from_one_end_of_the_stretch_to_the_other(stairs: Sheets) -> None:
    (rare, _) = stairs[1].axes[0].get_lines()
    assert rare.get_xdata().tolist() == pytest.approx([2.5, 2.9])
    assert np.ptp(rare.get_ydata()) == 0.0


def look(line: Any) -> tuple[Any, ...]:
    """The style of a curve, which differs from that of other curves."""
    return line.get_color(), str(line._dash_pattern), line.get_linewidth()


class Many:
    """A run of signals with long names and many elements."""

    def __init__(self, names: Sequence[str]) -> None:
        self.names = names

    @property
    def units(self) -> dict[str, str]:
        """The unit of every signal."""
        return dict.fromkeys(self.names, "m")

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return 100 elements."""
        return np.sin(self.times(name)[:, None] + np.arange(100.0))

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times of all rows."""
        return np.arange(0.0, 3.0, 0.1)

    def rate(self, name: str) -> str:
        """All are sampled."""
        return "vision"


SHORT, LONG = "a.y", "long/path/of/parts/with_a_long_block_name.and_a_port_of_many_letters"
ANOTHER = "another/path_that_shares_nothing/of_its_beginning.with_the_other_one"


def of(name: str, count: int, title: str = "", reference: float | None = None) -> Panel:
    return Panel((trace(f"{name}[0:{count}]"),), title, reference=reference)


def mixed(count: int, title: str = "") -> Panel:
    return Panel(tuple(trace(f"{name}[{i}]") for i in range(count) for name in (LONG, ANOTHER)), title)


CROWDED = {
    "12 long": (of(LONG, 12, "all of them"),),
    "three of 12": (of(LONG, 12, "a", 0.0), of(SHORT, 12, "b"), of(ANOTHER, 12, "c", 0.0)),
    "nothing shared, two": (mixed(10, "left"), mixed(6, "right")),
    "one word": (Panel((trace("a.y[0]", "x" * 300), trace("a.y[1]", "_y" * 100))), of(SHORT, 1)),
    "12 short": (of(SHORT, 12),),
    "40 short": (of(SHORT, 40, "forty"),),
    "40 long": (of(LONG, 40, reference=0.0),),
    "two of 12": (of(LONG, 12, "left", 0.0), of(SHORT, 12, "right", 0.0)),
    "two of 40": (of(LONG, 40, "left"), of(ANOTHER, 40, "right")),
    "three with long titles": tuple(of(name, 3, "a title that is long " * 5) for name in (SHORT, LONG) * 2),
    "nothing shared": (mixed(6),),
    "nothing shared, three": (mixed(3), mixed(6), mixed(20)),
}


@pytest.mark.parametrize("panels", mostly_slow([(panels,) for panels in CROWDED.values()], 2), ids=CROWDED)
def test_legends_fit_and_no_two_curves_look_alike(
    panels: tuple[Panel, ...], sheets: Sheets, tmp_path: Path
) -> None:
    plot_figures(Many((SHORT, LONG, ANOTHER)), [Figure("Crowded " * 40, panels)], tmp_path)
    (sheet,) = sheets
    renderer = sheet.canvas.get_renderer()
    page = sheet.bbox
    legends = [axes.get_legend().get_window_extent(renderer) for axes in sheet.axes]
    title = sheet._suptitle.get_window_extent(renderer)
    frames = [axes.get_window_extent(renderer) for axes in sheet.axes]
    for part in (*legends, title):
        assert page.x0 <= part.x0 and part.x1 <= page.x1 and page.y0 <= part.y0 and part.y1 <= page.y1 + 1
    pieces = [*legends, *frames, title]
    for one, other in itertools.combinations(pieces, 2):
        across = min(one.x1, other.x1) - max(one.x0, other.x0)
        along = min(one.y1, other.y1) - max(one.y0, other.y0)
        assert across < 1.0 or along < 1.0, (one, other)
    for axes, frame in zip(sheet.axes, frames, strict=True):
        assert frame.height >= 1.4 * sheet.dpi and frame.width >= 2.5 * sheet.dpi
        curves = [line for line in axes.get_lines() if not line.get_label().startswith("_child")]
        assert len({look(line) for line in curves}) == len(curves)
        assert len(set(legend(axes))) == len(curves)


def test_more_curves_than_can_be_named_have_colours_of_their_own(sheets: Sheets, tmp_path: Path) -> None:
    plot_figures(Many((SHORT,)), [Figure("All", (of(SHORT, 100, "hundred"),))], tmp_path)
    (axes,) = sheets[0].axes
    assert axes.get_legend() is None
    assert axes.get_title(loc="left") == "hundred: a.y\n100 signals, from dark to light"
    assert len({look(line) for line in axes.get_lines()}) == 100


def test_importing_the_plotter_does_not_import_matplotlib() -> None:
    code = "import sys, quadvis.output.plot; print('matplotlib' in sys.modules)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    result = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert result.stdout.split() == ["False"]
