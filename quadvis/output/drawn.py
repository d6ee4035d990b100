"""What is drawn of a diagram: blocks, wires and marks, and the sizes of everything."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from quadvis.output import svg

# Sizes in CSS pixels: fonts, then distances.
TITLE, NAME, PORT, SMALL = 18.0, 13.0, 11.0, 10.0
MARGIN, LINE, HEADER, ROW, INDENT, BETWEEN, ARROW = 24.0, 26.0, 38.0, 17.0, 7.0, 18.0, 9.0
FOOT = 13.0  # from line to line at the foot of a box
MAIN = 14.0  # from line to line of the main parameters
INK = "#111111"
FAULT = "#c4161c"  # the colour of errors
_LONGEST_MARK = 28
_LONG_NUMBER = re.compile(r"\d+\.\d{7,}(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class DrawnBlock:
    """A block: `path` is its name with the parts around it ("vision/detector"), `kind` its type in YAML.

    `lines` stand at its foot, `main` are the lines of its main parameters. `symbol` and `formula` say how it
    is drawn instead of as a box with its type: a symbol of `quadvis.block.symbol`; one text, or numerator
    and denominator. `signs` stand at inputs in the place of their names. A condition says of the part around
    it when that runs. `faulty` are the sentences of its faults by port; that of "" is about the block itself.
    """

    path: str
    kind: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    task: str
    lines: tuple[str, ...] = ()
    main: tuple[str, ...] = ()
    symbol: str = ""
    formula: tuple[str, ...] = ()
    signs: Mapping[str, str] = field(default_factory=dict)
    is_condition: bool = False
    faulty: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class DrawnWire:
    """A wire from `source` ("block.port" or "block.port[0]"); `crossing` says how it changes rates.

    `fault` says what is wrong with it.
    """

    source: str
    target_block: str
    target_port: str
    crossing: str | None = None
    fault: str = ""


@dataclass(frozen=True)
class Mark:
    """The mark before an input: the elements that its wire takes and how it crosses rates, or a constant."""

    text: str
    crossing: bool = False
    constant: bool = False

    @property
    def shown(self) -> str:
        """The text with numbers of few digits, cut if it is long."""
        text = _LONG_NUMBER.sub(lambda found: f"{float(found[0]):.6g}", self.text)
        return text if len(text) <= _LONGEST_MARK else text[: _LONGEST_MARK - 1] + "…"

    @property
    def width(self) -> float:
        """Pixels from left to right."""
        return svg.text_width(self.shown, SMALL) + INDENT


def last(path: str) -> str:
    """Return the name of a block or part without the parts around it."""
    return path.rpartition("/")[2]
