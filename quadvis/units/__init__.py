"""Units, and quantities in text: "50 ms", "1/30 s", "2.5 rad/s", "90 %"."""

from quadvis.units.grammar import UnitError
from quadvis.units.quantity import (
    format_quantity,
    format_ratio,
    parse_number,
    parse_period,
    parse_quantity,
    parse_rational,
    plain_text,
    read_quantity,
    read_ratio,
    require_unit,
    split_quantity,
)
from quadvis.units.unit import Unit, advised, parse_units, unify

__all__ = [
    "Unit", "UnitError", "advised", "format_quantity", "format_ratio", "parse_number",
    "parse_period", "parse_quantity", "parse_rational", "parse_units", "plain_text", "read_quantity",
    "read_ratio", "require_unit", "split_quantity", "unify",
]  # fmt: skip
