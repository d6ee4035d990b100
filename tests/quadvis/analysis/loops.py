"""Small loops in the form of diagrams, whose matrices and margins are known."""

from pathlib import Path

import quadvis
from quadvis.api import Diagram

REPOSITORY = Path(__file__).parents[3]
DIAGRAMS = REPOSITORY / "diagrams"

# A double integrator under sampled gains, with a held torque: its exact discretisation is known.
SAMPLED = """
quadvis: 1
name: sampled
params: {gain: 2 1/s^2, damping: 1.5 1/s}
rates: {fast: 20 Hz, slow: 10 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  speed: {block: signal.integrator, rate: continuous, in: {u: {from: push.y, across: hold}}}
  place: {block: signal.integrator, rate: continuous, with: {initial: 0.5 m}, in: {u: speed.y}}
  spring:
    {block: signal.gain, rate: fast, with: {factor: $gain}, in: {u: {from: place.y, across: sample}}}
  damper:
    {block: signal.gain, rate: fast, with: {factor: $damping}, in: {u: {from: speed.y, across: sample}}}
  both: {block: signal.sum, rate: fast, in: {u: [spring.y, damper.y, MORE]}}
  push: {block: signal.gain, rate: fast, with: {factor: -1}, in: {u: both.y}}
EXTRA
analyse:
  cuts: {push: push.y}
"""
# A block at half the rate that is on the loop and does nothing: the loop is lifted, and stays what it was.
IDLE = """
  idle:
    {block: signal.gain, rate: slow, with: {factor: 0 1/s^2}, in: {u: {from: place.y, across: sample}}}
"""


def limitless(name: str) -> str:
    """Return the text of a shipped diagram without its limits, whose search takes most of the time."""
    text = (DIAGRAMS / name).read_text().partition("  limits:")[0]
    return "".join(line for line in text.splitlines(True) if "{limit: " not in line)


def write(folder: Path, text: str) -> Path:
    """Write a diagram into a file."""
    path = folder / "loop.yaml"
    path.write_text(text)
    return path


def sampled(folder: Path, **settings: str) -> Diagram:
    """Return the sampled loop at its one rate."""
    text = SAMPLED.replace("MORE", "0").replace("EXTRA\n", "")
    return quadvis.load(write(folder, text), settings=settings)


def lifted(folder: Path, **settings: str) -> Diagram:
    """Return the same loop, lifted over two periods."""
    text = SAMPLED.replace("MORE", "{from: idle.y, across: hold}").replace("EXTRA", IDLE)
    return quadvis.load(write(folder, text), settings=settings)
