"""Faults with their places, and the words of their reports. All other packages use these names."""

from quadvis.errors.faults import (
    DiagramError,
    Doubt,
    Fault,
    Faults,
    Odd,
    OutOfRange,
    Place,
    QuadvisError,
    RunError,
)
from quadvis.errors.spelling import closest, suggestion
from quadvis.errors.unknown import UNKNOWN, Unknown, known
from quadvis.errors.words import counted, quoted, sentence

__all__ = [
    "UNKNOWN", "DiagramError", "Doubt", "Fault", "Faults", "Odd", "OutOfRange", "Place",
    "QuadvisError", "RunError",
    "Unknown", "closest", "counted", "known", "quoted", "sentence", "suggestion",
]  # fmt: skip
