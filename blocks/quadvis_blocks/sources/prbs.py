"""A pseudo-random binary sequence."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, Derived, Out, Param, State

# Places of the register whose exclusive or is fed back, beside the first: primitive polynomials over GF(2).
TAPS = {
    2: (1,), 3: (2,), 4: (3,), 5: (3,), 6: (5,), 7: (6,), 8: (7, 6, 1), 9: (5,), 10: (7,), 11: (9,),
    12: (11, 10, 4), 13: (12, 11, 8), 14: (13, 12, 2), 15: (14,), 16: (15, 13, 4), 17: (14,), 18: (11,),
    19: (18, 17, 14), 20: (17,),
}  # fmt: skip


class Prbs(Block):
    """A sequence of two values that looks like noise and is the same in every run.

    It is the longest sequence of a shift register. Each value is held for ``hold`` ticks; after
    ``2 ** order - 1`` of them the sequence begins again. Its spectrum is nearly flat up to a third of the
    rate at which the values change.
    """

    order = Param(7, type="int64", min=2, max=20, doc="how long the register is")
    hold = Param(1, type="int64", min=1, max=2**31, doc="how many ticks each value lasts")
    low = Param(-1.0, unit="a", tune=True, shown=True, doc="one value")
    high = Param(1.0, unit="a", tune=True, shown=True, doc="the other value, with which it begins")
    y = Out(unit="a", doc="the sequence")
    taps = Derived("int64", doc="the places that are fed back, as bits")
    register = State("int64")
    ticks = State("int64", doc="how long the present value has lasted")

    symbol = "binary_noise"
    example = """
        probe: {block: sources.prbs, rate: fast, with: {order: 5, hold: 2, low: -1 N, high: 1 N}}
    """

    def check(self) -> None:
        """Make the mask of the places that are fed back."""
        self.taps = 1 + sum(1 << place for place in TAPS[self.order])

    def start(self) -> None:
        """Begin with ones."""
        self.register = (1 << self.order) - 1
        self.ticks = 0

    def output(self) -> Any:
        """Return the value of the first place."""
        return self.high if self.register & 1 else self.low

    def update(self) -> None:
        """Shift the register when the value has lasted."""
        self.ticks += 1
        if self.ticks >= self.hold:
            self.ticks = 0
            fed = 0
            for place in range(self.order):
                fed ^= (self.register & self.taps) >> place & 1
            self.register = self.register >> 1 | fed << (self.order - 1)
