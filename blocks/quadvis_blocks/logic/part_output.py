"""An output of a part that runs under a condition."""

from __future__ import annotations

from typing import Any

from quadvis.block import NO_FRAME, Block, In, Out, Param, copied

KINDS = ("float64", "int64", "bool", "frame")
FLOAT, INT, BOOL, FRAME = range(4)


class PartOutput(Block):
    """The output of a part with ``when`` or ``triggered``: what its block gives, or the initial value.

    A picture has no initial value, but there is none then.
    """

    kind = Param("float64", choices=KINDS, doc="the kind of the signal")
    u = In("float64[*]", unit="a", doc="the signal in the part")
    initial = In("float64[*]", unit="a", default=0.0, doc="the output while the part does not show it")
    shown = In("bool", doc="whether the part shows it, from the part's `logic.run_condition`")
    y = Out("float64[*]", unit="a", nan=True, doc="the output of the part")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: wave.y, b: 1 m}}
        runs: {block: logic.run_condition, rate: fast, in: {when: high.y}}
        path: {block: signal.discrete_integrator, rate: fast, condition: runs, in: {u: wave.y}}
        given: {block: logic.part_output, rate: fast, in: {u: path.y, shown: runs.shown, initial: 1 m*s}}
    """

    @classmethod
    def ports(cls, kind: int) -> dict[str, Any]:
        """Return the ports for a kind of signal, and the method that chooses."""
        if kind == FLOAT:
            return {}
        signal = "frame" if kind == FRAME else f"{KINDS[kind]}[*]"
        made: dict[str, Any] = {
            "u": In(signal, doc="the signal in the part"),
            "y": Out(signal, doc="the output of the part"),
        }
        if kind == FRAME:
            return made | {"initial": None, "numeric": False, "output": cls.show}
        default = False if kind == BOOL else 0
        words = "the output while the part does not show it"
        output = cls.choose if kind == BOOL else cls.count
        return made | {"initial": In(signal, default=default, doc=words), "output": output}

    def output(self, u: Any, initial: Any, shown: bool) -> Any:
        """Return the number, or the initial one."""
        return copied(u) if shown else copied(initial)

    def choose(self, u: Any, initial: Any, shown: bool) -> Any:
        """Return the truth value, or the initial one."""
        if isinstance(u, bool):
            return u if shown else initial
        return u.copy() if shown else initial.copy()

    def count(self, u: Any, initial: Any, shown: bool) -> Any:
        """Return the whole number, or the initial one."""
        return 1 * u if shown else 1 * initial

    def show(self, u: Any, shown: bool) -> Any:
        """Return the picture, or none."""
        return u if shown else NO_FRAME
