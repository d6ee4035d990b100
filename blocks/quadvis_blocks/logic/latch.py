"""A truth value that is set and reset."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param, State

RESET, SET = range(2)


class Latch(Block):
    """A truth value that stays true from ``set`` to ``reset``; both act at once, while they are true."""

    priority = Param("reset", choices=("reset", "set"), doc="which of them counts while both are true")
    initial = Param(False, type="bool", doc="the output before the first of them")
    set = In("bool", doc="makes the output true")
    reset = In("bool", doc="makes the output false")
    y = Out("bool", doc="the truth value")
    held = State("bool")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: wave.y, b: 1 m}}
        low: {block: logic.compare, rate: fast, with: {operator: "<"}, in: {a: wave.y, b: -1 m}}
        alarm: {block: logic.latch, rate: fast, in: {set: high.y, reset: low.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the usual letters."""
        return ("S R",)

    def start(self) -> None:
        """Begin with the initial value."""
        self.held = self.initial

    def output(self, set: bool, reset: bool) -> bool:
        """Return the truth value."""
        return _held(self.priority, self.held, set, reset)

    def update(self, set: bool, reset: bool) -> None:
        """Keep it."""
        self.held = _held(self.priority, self.held, set, reset)


def _held(priority: int, held: bool, begin: bool, end: bool) -> bool:
    if begin and end:
        return priority == SET
    return (held or begin) and not end
