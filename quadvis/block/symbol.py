"""The symbols by which pictures of diagrams show blocks, as control engineers know them."""

from __future__ import annotations

from quadvis.errors import sentence, suggestion

# Outlines of their own: a circle with signs, a triangle around the factor, a bar. All others stand in a box.
SUM, GAIN, BAR = OUTLINES = ("sum", "gain", "bar")
VALUE = "value"  # the main parameter itself
CURVES = (
    "backlash", "binary_noise", "chirp", "clock", "dead_zone", "friction", "lookup", "noise", "pulse",
    "quantizer", "ramp", "rate_limiter", "relay", "saturation", "sequence", "sine", "spectrum", "step",
    "switch",
)  # fmt: skip
SYMBOLS = (*OUTLINES, VALUE, *CURVES)


def check_symbol(name: str, owner: str) -> None:
    """Refuse a symbol that there is not; "" is none. TypeError names the class."""
    if name and name not in SYMBOLS:
        remedy = suggestion(name, SYMBOLS) or f"choose from {', '.join(SYMBOLS)}"
        raise TypeError(sentence(f"{owner} has the symbol '{name}', which there is not", remedy))
