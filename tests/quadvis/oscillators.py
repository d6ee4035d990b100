"""Van der Pol's oscillator, with which solvers are tried: stiff, and with sudden jumps."""

from __future__ import annotations


def van_der_pol(solver: str, stop_time: str) -> str:
    """Return the diagram of the oscillator for mu = 1000; ``solver`` is what the diagram says of it."""
    return f"""\
quadvis: 1
name: van der Pol
solver: {solver}
stop_time: {stop_time}
blocks:
  law:
    block: math.expression
    rate: continuous
    with: {{y: mu * (1 - x * x) * v - w * x, mu: 1000 1/s, w: 1 1/s^2}}
    in: {{x: x.y, v: v.y}}
  v: {{block: signal.integrator, in: {{u: law.y}}}}
  x: {{block: signal.integrator, with: {{initial: 2}}, in: {{u: v.y}}}}
"""
