"""The style of figures: type, colours, sizes, and the fitting of texts."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from quadvis.output.canvas import text_width
from quadvis.units import Unit

# Okabe and Ito's colours, which colour-blind readers can distinguish.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#222222", "#B8A800")
# Dashes distinguish curves when all colours are used.
DASHES: tuple[Any, ...] = (
    "solid",
    (0, (5, 1.5)),
    (0, (1.2, 1.2)),
    (0, (7, 1.5, 1.2, 1.5)),
    (0, (7, 1.5, 1.2, 1.5, 1.2, 1.5)),
)
STYLE: Mapping[Any, Any] = {
    "axes.edgecolor": "#666666",
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 11,
    "axes.xmargin": 0.0,
    "axes.ymargin": 0.08,
    "figure.titlesize": 13,
    "figure.titleweight": "bold",
    "font.size": 10,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "legend.borderaxespad": 0.0,
    "legend.borderpad": 0.2,
    "legend.columnspacing": 1.6,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "legend.handletextpad": 0.7,
    "legend.labelspacing": 0.35,
    "legend.title_fontsize": 11,
    "lines.linewidth": 1.0,
    "text.parse_math": False,
    "xtick.color": "#444444",
    "ytick.color": "#444444",
}
WIDTHS = (8.0, 10.0, 13.0)  # inches, by the number of columns
POINT = 1.0 / 72.0  # inches
ELLIPSIS = "…"
JOINTS = " /.,_-"  # a text may be broken after these

Measure = Callable[[str], float]  # the width of a text (inches)


def measure(size: float, *, bold: bool = False) -> Measure:
    """Return a function that measures texts of a size (points) in the typeface of the figures."""
    return partial(text_width, size=size, bold=bold)


def fitted(text: str, room: float, width: Measure, lines: int = 2) -> str:
    """Return a text in at most ``lines`` lines, none wider than ``room`` (inches).

    Lines break after joints. A text that is too long loses its middle, because names differ at their ends.
    """
    text = re.sub(r"[\t\n\v\f\r]", " ", text)
    found: list[str] = []
    while width(text) > room and len(found) < lines - 1:
        end = _fitting(text, room, width)
        joint = max(text.rfind(letter, 0, end) for letter in JOINTS) + 1
        end = joint if joint > end // 3 else end
        found.append(text[:end].rstrip())
        text = text[end:].lstrip()
    if width(text) > room:
        half = max(1, _fitting(text, room, width) // 2)
        while half > 1 and width(text[:half] + ELLIPSIS + text[-half:]) > room:
            half -= 1
        text = text[:half] + ELLIPSIS + text[-half:]
    return "\n".join([*found, text])


def _fitting(text: str, room: float, width: Measure) -> int:
    """Return the number of letters that fit, at least one."""
    low, high = 1, len(text)
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if width(text[:middle]) <= room else (low, middle - 1)
    return low


def pretty(unit: Unit) -> str:
    """Return a unit as it is written beside an axis."""
    text = str(unit)
    return "" if text == "1" else text.replace("^2", "²").replace("^3", "³").replace("*", "\u00b7")
