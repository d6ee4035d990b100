"""Pictures of a run, as its diagram asks for them under `figures:`; without that, one picture per block.

    figures:
      - title: Position estimate           # in lower case also the name of the file
        from: 40 s                         # stretch of the run; all of it if absent
        to: 140 s
        panels:                            # side by side, three in a row
          - title: x
            signals:
              - plant.position[0]          # a signal, an element [2,1], or elements [0:2]
              - {signal: "vision/pose.position[0]", label: camera}
            unit: cm                       # of the axis; the first signal's own if absent
            reference: 0                   # dashed line; the legend has the RMS of the distance from it
      - title: Yaw angle                   # a figure of one panel may have the panel's keys
        signals: plant.attitude[2]
        unit: deg

A reference is in the unit of the axis, or brings its own ("4 cm"). In YAML's flow style a signal with an
index needs quotes. Only a title and signals are required. Sampled signals are drawn as stairs, since they
stand still between their ticks; those of the continuous rate as lines.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.document import nodes
from quadvis.engine.names import read_name
from quadvis.errors import DiagramError, Faults, QuadvisError, quoted, suggestion
from quadvis.machine.files import PNG, write_output
from quadvis.output.canvas import blank_sheet
from quadvis.output.panel import Curve, draw_panel, legend_of
from quadvis.output.stretch import NANOSECONDS, stamp
from quadvis.output.style import STYLE, WIDTHS, fitted, measure
from quadvis.units import Unit, UnitError, parse_units

if TYPE_CHECKING:
    from quadvis.output.log_reader import Log

HEIGHT = 3.6  # inches of a row
TITLE = 0.5  # inches for the title of a picture, and for each line more half of it
LONGEST_NAME = 200  # bytes of a file's name before its number and ending
SIDE = 0.5  # inches that a title leaves free

CONTINUOUS = "continuous"  # the rate of what the solver integrates; all others are sampled
STRETCH_KEYS = ("from", "to")
PANEL_KEYS = ("signals", "title", "unit", "reference")
TRACE_KEYS = ("signal", "label")
FIGURE_KEYS = ("title", *STRETCH_KEYS, "panels", "signals", "unit", "reference")


class Recorded(Protocol):
    """Recorded signals by name, of a run or of a log: arrays with a leading time axis."""

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of every signal that there is."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the rows of a signal."""

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times (s) of its rows."""

    def rate(self, name: str) -> str:
        """Return the name of the rate at which its block works; "" if that is not known."""


@dataclass(frozen=True)
class Trace:
    """One entry of `signals`, "plant.position" or "detector.centres[2,1]", and what the legend calls it."""

    signal: str
    label: str = ""


@dataclass(frozen=True)
class Panel:
    """One pair of axes; without a unit it shows that of its first signal. The reference is in that unit."""

    traces: tuple[Trace, ...]
    title: str = ""
    unit: str = ""
    reference: float | None = None


@dataclass(frozen=True)
class Figure:
    """One picture, of the run between `start` and `stop` (s)."""

    title: str
    panels: tuple[Panel, ...]
    start: float = -math.inf
    stop: float = math.inf


def plot_log(log: Log, output: Path | None = None) -> list[Path]:
    """Draw what the log's diagram asks for; return the PNG files, in `output` or in a folder beside the log.

    DiagramError if `figures:` is wrong, QuadvisError if it names signals that were not logged.
    """
    from quadvis.document import parse_yaml

    faults = Faults()
    root = parse_yaml(log.diagram, f"{log.path}: diagram") if log.diagram.strip() else None
    declared = root.get("figures") if isinstance(root, nodes.YamlMap) else None
    figures = read_figures(declared, faults) if declared else []
    faults.check()
    folder = output or log.path.with_name(f"{log.path.stem}-figures")
    return plot_figures(log, figures or block_figures(log), folder, [log.path])


def plot_figures(
    recorded: Recorded, figures: Iterable[Figure], folder: Path, inputs: Sequence[Path] = ()
) -> list[Path]:
    """Draw every figure as `<number>-<title>.png` in `folder` and return the files.

    QuadvisError names, before anything is drawn, all signals that are not there or do not fit their panel;
    files that are `inputs`, or no pictures, are not replaced.
    """
    found: list[tuple[Figure, list[list[Curve]]]] = []
    problems: list[str] = []
    for figure in figures:
        found.append((figure, []))
        if not figure.panels:
            problems.append(f"figure {quoted(figure.title)} has no panels; give it signals")
        for panel in figure.panels:
            try:
                found[-1][1].append(_curves(recorded, figure, panel))
            except QuadvisError as error:
                problems.append(f"figure {quoted(figure.title)}: {error}")
    if problems:
        raise QuadvisError("\n".join(problems))
    digits = len(str(len(found)))
    paths = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for number, (figure, curves) in enumerate(found, 1):
            paths.append(folder / f"{number:0{digits}}-{_file_name(figure.title)}.png")
            _draw(figure, curves, paths[-1], inputs)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise QuadvisError(f"cannot write figures to '{folder}': {reason}") from error
    return paths


def block_figures(recorded: Recorded) -> list[Figure]:
    """Return a figure for every block, with a panel for every port, or for every unit in it."""
    blocks: dict[str, list[Panel]] = {}
    for name, text in recorded.units.items():
        block, _, port = name.rpartition(".")
        panels = blocks.setdefault(block, [])
        units = parse_units(text)
        if len(units) == 1:
            panels.append(Panel((Trace(name, port),), port))
            continue
        places = [f"[{','.join(map(str, place))}]" for place in np.ndindex(recorded[name].shape[1:])]
        for shown in dict.fromkeys(units):
            chosen = (place for place, unit in zip(places, units, strict=True) if unit == shown)
            panels.append(Panel(tuple(Trace(name + place, port + place) for place in chosen), port))
    return [Figure(block, tuple(panels)) for block, panels in blocks.items()]


def read_figures(node: nodes.YamlNode, faults: Faults) -> list[Figure]:
    """Return what stands under `figures:`; what is wrong there is added to the faults."""
    figures = (faults.collect(_read_figure, entry, faults) for entry in faults.collect(node.items) or [])
    return [figure for figure in figures if figure]


def _read_figure(node: nodes.YamlNode, faults: Faults) -> Figure:
    single = "panels" not in node.mapping()
    keys = [key for key in PANEL_KEYS if key != "title"] if single else ["panels"]
    entry = node.fields(("title", keys[0]), (*STRETCH_KEYS, *keys[1:]), faults)
    title = entry.get("title")
    name = faults.collect(title.text) if title else None
    panels = [entry] if single else faults.collect(_some, entry["panels"]) or []
    read = (faults.collect(_read_panel, panel, faults, single) for panel in panels)
    start = _read_seconds(entry.get("from"), -math.inf, faults)
    stop = _read_seconds(entry.get("to"), math.inf, faults)
    if start >= stop:
        faults.add(entry["to"].place, "'to' must come after 'from'")
    return Figure(name or "figure", tuple(panel for panel in read if panel), start, stop)


def _read_seconds(node: nodes.YamlNode | None, absent: float, faults: Faults) -> float:
    """Return a time as the rows of a log have it: rounded down to a nanosecond, so that its own row is in."""
    if node is None or faults.collect(node.quantity, Unit.parse("s"), bare=False) is None:
        return absent
    return stamp(node.exact(Unit.parse("s"))) / NANOSECONDS


def _some(node: nodes.YamlNode) -> list[nodes.YamlNode]:
    """Return the entries of a list that must not be empty."""
    if not node.items():
        raise node.fault("the list is empty", "write its entries, or leave the key out")
    return node.items()


def _read_panel(node: nodes.YamlNode, faults: Faults, single: bool) -> Panel:
    """Read a panel; in a figure of one panel the keys and the title are the figure's."""
    entry = node.mapping() if single else node.fields(PANEL_KEYS[:1], PANEL_KEYS[1:], faults)
    title, signals, unit, reference = map(entry.get, ("title", "signals", "unit", "reference"))
    entries = _some(signals) if isinstance(signals, nodes.YamlList) else [signals] if signals else []
    traces = [faults.collect(_read_trace, trace) for trace in entries]
    shown = faults.collect(_read_unit, unit) if unit else None
    level = faults.collect(reference.quantity, shown or Unit()) if reference else None
    name = faults.collect(title.text) if title and not single else None
    return Panel(tuple(trace for trace in traces if trace), name or "", str(shown) if shown else "", level)


def _read_unit(node: nodes.YamlNode) -> Unit:
    try:
        return Unit.parse(node.text())
    except UnitError as error:
        raise node.fault(error.problem, error.remedy) from None


def _read_trace(node: nodes.YamlNode) -> Trace:
    label = None
    if isinstance(node, nodes.YamlMap):
        entry = node.fields(TRACE_KEYS[:1], TRACE_KEYS[1:])
        node, label = entry["signal"], entry.get("label")
    try:
        split_signal(node.text())
    except DiagramError:
        raise
    except QuadvisError as error:
        raise node.fault(str(error)) from None
    return Trace(node.text(), label.text() if label else "")


def split_signal(text: str) -> tuple[str, tuple[int | slice, ...]]:
    """Split "plant.position[0:2]" into the signal's name and an index as numpy takes it."""
    named = read_name(text)
    if named is None:
        remedy = "write 'block.port', 'block.port[0]' or 'block.port[0:2]'"
        raise QuadvisError(f"{quoted(text)} is not a signal; {remedy}")
    return named.source, named.index


def _curves(recorded: Recorded, figure: Figure, panel: Panel) -> list[Curve]:
    """Return a panel's curves over the figure's stretch of the run, in the unit that the panel shows."""
    found = [curve for trace in panel.traces for curve in _elements(recorded, trace)]
    if not found:
        raise QuadvisError(f"panel {quoted(panel.title)} has no signals; name one")
    shown = Unit.parse(panel.unit) if panel.unit else found[0].unit
    curves = []
    for curve in found:
        if not curve.unit.dimension_equals(shown):
            raise QuadvisError(f"{quoted(curve.label)} is in {curve.unit}, which cannot be shown in {shown}")
        part = (curve.times >= figure.start) & (curve.times <= figure.stop)
        values = curve.values * (curve.unit.scale / shown.scale)
        earlier = values[curve.times < figure.start]
        before = float(earlier[-1]) if earlier.size else math.nan
        times = curve.times[part]
        curves.append(replace(curve, unit=shown, times=times, values=values[part], before=before))
    return curves


def _elements(recorded: Recorded, trace: Trace) -> Iterator[Curve]:
    """Return one curve for every element that a trace selects."""
    name, index = split_signal(trace.signal)
    if name not in recorded.units:
        remedy = suggestion(name, recorded.units) or "the log may leave its block out"
        raise QuadvisError(f"there is no signal {quoted(name)}; {remedy}")
    rows, times, units = recorded[name], recorded.times(name), parse_units(recorded.units[name])
    shape, size = rows.shape[1:], math.prod(rows.shape[1:])
    try:
        chosen = np.arange(size).reshape(shape)[index].ravel().tolist()
    except IndexError:
        chosen = []
    if not chosen:
        extent = f"the shape {list(shape)}" if shape else "one element and takes no index"
        raise QuadvisError(f"{quoted(trace.signal)} does not exist; {quoted(name)} has {extent}")
    elements = rows.reshape(len(rows), size)
    held = rows.dtype.kind != "f" or recorded.rate(name) not in ("", CONTINUOUS)
    for element in chosen:
        label = trace.label or name
        if shape and (len(chosen) > 1 or not trace.label):
            label += f"[{','.join(map(str, np.unravel_index(element, shape)))}]"
        values = elements[:, element].astype(np.float64)
        yield Curve(label, units[element % len(units)], times, values, held, rows.dtype.kind != "f")


def _file_name(title: str) -> str:
    name = re.sub(r"\W+", "-", title.lower()).strip("-")[:60]
    try:
        os.fsencode(name)
    except UnicodeError:  # the system's names have no such letters
        name = re.sub(r"[^a-z0-9_]+", "-", name).strip("-")
    while len(os.fsencode(name)) > LONGEST_NAME:
        name = name[:-1]
    return name or "figure"


def _draw(figure: Figure, panels: list[list[Curve]], path: Path, inputs: Sequence[Path]) -> None:
    columns = min(len(WIDTHS), len(panels))
    width = WIDTHS[columns - 1]
    pairs = list(zip(figure.panels, panels, strict=True))
    legends = [legend_of(panel.title, curves, panel.reference, width / columns) for panel, curves in pairs]
    title = fitted(figure.title, width - SIDE, measure(STYLE["figure.titlesize"], bold=True), lines=3)
    # A row is as high as its highest legend asks for, so that the axes keep their height.
    rows = [legends[start : start + columns] for start in range(0, len(legends), columns)]
    heights = [HEIGHT + max(legend.height for legend in row) for row in rows]
    height = TITLE * (1.0 + 0.5 * title.count("\n")) + sum(heights)
    with blank_sheet(width, height, STYLE, layout="constrained") as sheet:
        sheet.suptitle(title)
        grid = sheet.add_gridspec(len(rows), columns, height_ratios=heights)
        for number, ((panel, curves), legend) in enumerate(zip(pairs, legends, strict=True)):
            axes = sheet.add_subplot(grid[divmod(number, columns)])
            draw_panel(axes, curves, panel.reference, (figure.start, figure.stop), legend)
        write_output(path, PNG, lambda file: sheet.savefig(file, format="png"), inputs)
