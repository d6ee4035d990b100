"""Write SVG: elements, escaped text, and the width of a text."""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.sax.saxutils import escape, quoteattr

FONT = "sans-serif"


def element(tag: str, content: str | None = None, /, **attributes: str | float) -> str:
    """Return an element; `stroke_width=1` becomes stroke-width="1", numbers are rounded to tenths (px)."""
    named = ((key.rstrip("_").replace("_", "-"), value) for key, value in attributes.items())
    listed = "".join(f" {name}={_quoted(value)}" for name, value in named)
    return f"<{tag}{listed}/>" if content is None else f"<{tag}{listed}>{escape(_printable(content))}</{tag}>"


def opening(tag: str, **attributes: str | float) -> str:
    """Return the opening tag of an element that contains others."""
    return element(tag, **attributes).removesuffix("/>") + ">"


def text(
    content: str,
    x: float,
    y: float,
    size: float,
    *,
    bold: bool = False,
    anchor: str = "start",
    fill: str = "#111111",
    class_: str = "",
) -> str:
    """Return a text whose base line starts, ends or has its middle at (x, y), according to `anchor`."""
    more = ({"font_weight": "bold"} if bold else {}) | ({"class_": class_} if class_ else {})
    return element("text", content, x=x, y=y, font_size=size, text_anchor=anchor, fill=fill, **more)


def points(corners: Iterable[tuple[float, float]]) -> str:
    """Return corners as the attribute `points` of a polyline or polygon."""
    return " ".join(f"{_number(x)},{_number(y)}" for x, y in corners)


def text_width(content: str, size: float, *, bold: bool = False) -> float:
    """Return a width (px) that the text does not exceed in any usual sans-serif face, DejaVu Sans too."""
    return round(sum(map(_ems, content)) * size * (1.12 if bold else 1.0), 1)


def _ems(character: str) -> float:
    if character in "ijl.,:;'|!()[]frt/ -":
        return 0.42
    if character in "mwMWQO%@—…→" or ord(character) > 0x24F:
        return 1.0
    return 0.78 if character.isupper() else 0.64


def _quoted(value: str | float) -> str:
    return quoteattr(_printable(value) if isinstance(value, str) else _number(value))


def _number(value: float) -> str:
    return f"{round(value, 1):.10g}"


def _printable(content: str) -> str:
    """Replace the characters that XML cannot hold: control characters and halves of surrogate pairs."""
    return re.sub("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", content)
