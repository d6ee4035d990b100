"""Faults with their places, and the words in which they are reported. The names that all rooms use."""

from quadvis.errors.faults import DiagramError, Doubt, Fault, Faults, Odd, Place, QuadvisError, RunError
from quadvis.errors.spelling import closest, suggestion
from quadvis.errors.unknown import UNKNOWN, Unknown, known
from quadvis.errors.words import quoted, sentence

__all__ = [
    "UNKNOWN", "DiagramError", "Doubt", "Fault", "Faults", "Odd", "Place", "QuadvisError", "RunError",
    "Unknown", "closest", "known", "quoted", "sentence", "suggestion",
]  # fmt: skip
