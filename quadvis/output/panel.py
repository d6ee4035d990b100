"""One pair of axes: distinguishable curves, and a legend that fits above them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.output.curves import Curve
from quadvis.output.style import COLOURS, DASHES, POINT, STYLE, fitted, measure, pretty
from quadvis.units import Unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

METRE = Unit.parse("m")
MOST_CURVES = len(COLOURS) * len(DASHES)  # curves that a legend can name
FEW_SAMPLES = 40  # up to so many samples each one gets a mark
LEAST_LABEL = 1.1  # inches; labels are not cut below this length to gain a column
ROWS_INSIDE = 4  # rows of a legend above which its labels are made shorter
ROOM_INSIDE = 5.0  # times the size of the letters: the height of a legend for which a panel has room
LINE = 1.25  # distance of lines, times the size of the letters
BESIDE, BETWEEN = (  # inches: the width of a label's sample line, and of the gap between columns
    STYLE["legend.fontsize"] * POINT * factor
    for factor in (
        STYLE["legend.handlelength"] + STYLE["legend.handletextpad"],
        STYLE["legend.columnspacing"],
    )
)
MARGIN = 0.95  # inches beside the axes, for numbers, unit, and the gap to the neighbour


@dataclass(frozen=True)
class Legend:
    """The labels of the curves, cut to fit, in columns under a title; without labels if there are too many.

    ``height`` (inches) is the height that it needs in addition to the room of a panel.
    """

    title: str
    labels: tuple[str, ...]
    columns: int
    height: float


def legend_of(title: str, curves: Sequence[Curve], reference: float | None, room: float) -> Legend:
    """Return the legend of a panel whose width, margin included, is ``room`` (inches)."""
    size, head_size = STYLE["legend.fontsize"], STYLE["legend.title_fontsize"]
    room -= MARGIN
    names, notes = [curve.label for curve in curves], [_note(curve, reference) for curve in curves]
    columns, is_broken = _columns(names, notes, room)
    if is_broken and (shared := _shared(names)):
        title = ": ".join(filter(None, (title, shared)))
        names = [name.removeprefix(shared) for name in names]
        columns, _ = _columns(names, notes, room)
    head = fitted(title, room, measure(head_size))
    height = head.count("\n") * LINE * head_size * POINT
    if len(curves) > MOST_CURVES:
        return Legend(head, (), 1, height)
    each = (room + BETWEEN) / columns - BESIDE - BETWEEN
    labels = [_label(*parts, each) for parts in zip(names, notes, strict=True)]
    rows = math.ceil(len(labels) / columns)
    stacks = [labels[start : start + rows] for start in range(0, len(labels), rows)]
    lines = max((len("\n".join(stack).splitlines()) for stack in stacks), default=0)
    used = LINE * lines + STYLE["legend.labelspacing"] * rows
    return Legend(head, tuple(labels), columns, height + max(0.0, used - ROOM_INSIDE) * size * POINT)


def _columns(names: Sequence[str], notes: Sequence[str], room: float) -> tuple[int, bool]:
    """Return the number of columns of labels, and whether some labels are broken into two lines."""
    width = measure(STYLE["legend.fontsize"])
    widest = max((width(name + note) for name, note in zip(names, notes, strict=True)), default=0.0)

    def fit(label: float) -> int:
        return max(1, min(len(names), int((room + BETWEEN) / (BESIDE + BETWEEN + label))))

    if fit(widest) < len(names) and math.ceil(len(names) / fit(widest)) > ROWS_INSIDE:
        needed = math.ceil(len(names) / ROWS_INSIDE)
        return max(fit(widest), min(needed, fit(min(widest, LEAST_LABEL)))), True
    return fit(widest), BESIDE + widest > room


def _shared(names: Sequence[str]) -> str:
    """Return the common beginning of all names, up to the last joint of a signal's name."""
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    return re.sub(r"[^./\[]*$", "", "".join(letters[0] for letters in alike)).rstrip("[")


def _note(curve: Curve, reference: float | None) -> str:
    """Return the RMS of a curve's distance from the reference as text; "" without a reference."""
    distance = curve.values[np.isfinite(curve.values)] - (reference or 0.0)
    if reference is None or curve.whole or not distance.size:
        return ""
    with np.errstate(over="ignore"):
        rms = np.sqrt(np.mean(distance**2))
    return f"   RMS {rms:.3g} {pretty(curve.unit)}".rstrip()


def _label(name: str, note: str, room: float) -> str:
    """Return a name in two lines at most, with the note after it or below it."""
    width = measure(STYLE["legend.fontsize"])
    label = fitted(name, room, width)
    if width(label.rpartition("\n")[2] + note) <= room:
        return label + note
    return f"{label}\n{fitted(note.lstrip(), room, width, lines=1)}"


def draw_panel(
    axes: Axes, curves: Sequence[Curve], reference: float | None, stretch: tuple[float, float], legend: Legend
) -> None:
    """Draw curves over a stretch of the run (s) or over another signal, and the legend above.

    A dashed line is at the reference.
    """
    from matplotlib.ticker import MaxNLocator

    end = max((float(curve.times[-1]) for curve in curves if curve.times.size), default=math.nan)
    handles = [
        _draw_curve(axes, curve, stretch[0], end, _look(number, curves))
        for number, curve in enumerate(curves)
    ]
    if reference is not None:
        axes.axhline(reference, color="#555555", linewidth=0.9, linestyle=(0, (5, 3)))
    if not any(np.isfinite(curve.values).any() for curve in curves):
        axes.text(0.5, 0.5, "no samples", transform=axes.transAxes, ha="center", color="#777777")
    if all(curve.whole for curve in curves):
        axes.yaxis.set_major_locator(MaxNLocator("auto", integer=True))
    axes.set_ylabel(pretty(curves[0].unit))
    if curves[0].across is None:
        axes.set_xlabel("time (s)")
        axes.set_xlim(*(end if math.isfinite(end) else None for end in stretch))
    else:
        _set_across(axes, curves[0])
    if not legend.labels:
        words = f"{len(curves)} signals, from dark to light"
        axes.set_title("\n".join(filter(None, (legend.title, words))), loc="left")
        return
    # The legend stands above the axes, so that it never hides a curve; the panel's title is its heading.
    made = axes.legend(
        handles, [" "] * len(handles), title=legend.title or None, alignment="left", loc="lower left",
        bbox_to_anchor=(0.0, 1.0), ncols=legend.columns,
    )  # fmt: skip
    for text, label in zip(made.get_texts(), legend.labels, strict=True):
        text.set_text(label)  # set here, because matplotlib leaves out labels that begin with '_'


def _set_across(axes: Axes, curve: Curve) -> None:
    """Name what lies across; two lengths have one scale, so that a path has its own form."""
    unit = pretty(curve.across_unit)
    axes.set_xlabel(f"{curve.across_label} ({unit})" if unit else curve.across_label)
    axes.margins(x=STYLE["axes.ymargin"])
    if curve.across_unit == curve.unit and curve.unit.dimension_equals(METRE):
        axes.set_aspect("equal", adjustable="datalim")


def _look(number: int, curves: Sequence[Curve]) -> dict[str, Any]:
    """Return the style of a curve; no two curves look alike.

    The curves of one signal in several recordings have one colour and several dashes, where that can be.
    """
    count = len(curves)
    if max(curve.place for curve in curves) < len(COLOURS) and curves[-1].recording < len(DASHES):
        curve = curves[number]
        return {"color": COLOURS[curve.place], "linestyle": DASHES[curve.recording]}
    if count <= MOST_CURVES:
        dashes, colour = divmod(number, len(COLOURS))
        return {"color": COLOURS[colour], "linestyle": DASHES[dashes]}
    from matplotlib import colormaps

    return {"color": colormaps["viridis"](number / (count - 1)), "linestyle": "solid"}


def _draw_curve(axes: Axes, curve: Curve, start: float, end: float, look: dict[str, Any]) -> Any:
    """Draw a curve; a held curve reaches from the start of the stretch to ``end``, the last sample."""
    times, values = curve.times, curve.values
    if curve.across is not None:
        (line,) = axes.plot(curve.across, values, label=curve.label, **look)
        return line
    few = np.count_nonzero(np.isfinite(values)) <= FEW_SAMPLES
    marks = list(range(len(times)))
    if curve.held and math.isfinite(end):
        if math.isfinite(curve.before) and (not times.size or start < times[0]):
            times, values = np.append(start, times), np.append(curve.before, values)
            marks = [mark + 1 for mark in marks]
        if times.size and times[-1] < end:
            times, values = np.append(times, end), np.append(values, values[-1])
    (line,) = axes.plot(
        times, values, label=curve.label, drawstyle="steps-post" if curve.held else "default",
        marker="." if few else "", markevery=marks if few else None, **look,
    )  # fmt: skip
    return line
