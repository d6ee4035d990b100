"""A delay of several samples."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, ParameterError, State

RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


class Delay(Block):
    """The signal of ``steps`` samples ago: ``y[k] = u[k - steps]``. It breaks algebraic loops.

    Before, the output is ``initial``, or one value of ``first`` after the other. Block
    `signal.transport_delay` delays by a time.
    """

    steps = Param(1, type="int64", min=1, max=100_000, doc="how many samples")
    initial = Param(0.0, type="float64[*?]", unit="a", doc="the output before the first sample arrives")
    first = Param(
        (), type="float64[k]", unit="a", doc="the outputs before, the oldest first, in place of ``initial``"
    )
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="a", doc="the signal of so many samples ago")
    kept = State("float64[1,*]", doc="the samples on their way, in a ring")
    place = State("int64", doc="where the ring begins")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        late: {block: signal.delay, rate: fast, with: {steps: 5}, in: {u: wave.y}}
    """

    @classmethod
    def ports(cls, steps: int) -> dict[str, Any]:
        """Return room for the samples."""
        return {"kept": State(f"float64[{steps},*]", doc="the samples on their way, in a ring")}

    def picture_formula(self) -> tuple[str, ...]:
        """Return the shift by so many samples."""
        return (f"z⁻{str(self.steps).translate(RAISED)}",)

    def check(self) -> None:
        """Refuse first outputs that are not as many as the samples."""
        if len(self.first) not in (0, self.steps):
            problem = f"first must have one value for each of {self.steps} samples, got {len(self.first)}"
            raise ParameterError("first", problem)

    def start(self) -> None:
        """Begin with the initial values."""
        self.place = 0
        self.kept[...] = self.initial
        for index in range(len(self.first)):
            self.kept[index] = self.first[index]

    def output(self) -> Any:
        """Return the oldest sample."""
        return self.kept[self.place]

    def update(self, u: Any) -> None:
        """Keep this sample in the place of the oldest."""
        self.kept[self.place] = u
        self.place = (self.place + 1) % self.steps
