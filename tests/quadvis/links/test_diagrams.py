"""Diagrams on several computers: they load, run and are analysed as one, and are written out whole."""

from __future__ import annotations

import numpy as np
import pytest

from quadvis.api import Diagram, load_text

# A double integrator under sampled gains; WORLD and TARGET say where its blocks are, NEAR and BACK how they meet.
LOOP = """
quadvis: 1
name: loop
rates: {fast: 20 Hz, step: 100 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 3 s
NETWORK
blocks:
  speed: {block: signal.integrator, rate: continuous, WORLD in: {u: {from: FORCE, across: hold}}}
  place: {block: signal.integrator, rate: continuous, WORLD with: {initial: 0.5 m}, in: {u: speed.y}}
  spring: {block: signal.gain, rate: fast, TARGET with: {factor: 2 1/s^2}, in: {u: {from: PLACE, across: sample}}}
  damper: {block: signal.gain, rate: fast, TARGET with: {factor: 1.5 1/s}, in: {u: {from: SPEED, across: sample}}}
  both: {block: signal.sum, rate: fast, TARGET in: {a: spring.y, b: damper.y}}
  push: {block: signal.gain, rate: fast, TARGET with: {factor: -1}, in: {u: both.y}}
DELAYS
analyse:
  cuts: {push: push.y}
"""
COMPUTERS = "computers: {world: {}, target: {}}\n"
DELAYS = "".join(
    f"""
  one_{name}: {{block: signal.stack, rate: step, in: {{a: {{from: {source}.y, across: {across}}}}}}}
  late_{name}: {{block: signal.transport_delay, rate: step, with: {{delay: {name}_DELAY}}, in: {{u: one_{name}.y}}}}
"""
    for name, source, across in (
        ("force", "push", "hold"),
        ("place", "place", "sample"),
        ("speed", "speed", "sample"),
    )
)


def linked(links: str = "", extra: str = "") -> Diagram:
    """Return the loop on two computers."""
    text = LOOP.replace("NETWORK", COMPUTERS + links).replace("DELAYS", extra)
    text = text.replace("WORLD", "at: world,").replace("TARGET", "at: target,")
    return load_text(text.replace("FORCE", "push.y").replace("PLACE", "place.y").replace("SPEED", "speed.y"))


def delayed(force: str, place: str) -> Diagram:
    """Return the loop on one computer, with delays in the place of links."""
    text = LOOP.replace("NETWORK", "").replace("WORLD", "").replace("TARGET", "")
    delays = DELAYS.replace("force_DELAY", force).replace("place_DELAY", place).replace("speed_DELAY", place)
    text = (
        text.replace("FORCE", '"late_force.y[0]"')
        .replace("PLACE", '"late_place.y[0]"')
        .replace("SPEED", '"late_speed.y[0]"')
    )
    return load_text(text.replace("DELAYS", delays))


SERIAL = """
links:
  up: {from: world, to: target, via: serial, baud: 38400}
  down: {from: target, to: world, via: serial, baud: 9600}
"""
# A message to the target has 33 bytes: it takes 8.6 ms, and is read at the next tick of 50 ms after it came. A
# message to the world has 25 bytes: it takes 26 ms, and is read at the next step of 10 ms.
CASES = [("", "10 ms", "10 ms"), (SERIAL, "30 ms", "10 ms")]


@pytest.mark.parametrize(("links", "force", "place"), CASES, ids=["memory", "serial"])
def test_a_link_is_a_delay_in_a_run_and_in_an_analysis(links: str, force: str, place: str) -> None:
    one, other = linked(links), delayed(force, place)
    first, second = one.run(), other.run()
    for signal in ("place.y", "speed.y", "push.y"):
        np.testing.assert_array_equal(first[signal], second[signal])
    found, wanted = (diagram.analyse().loops["push"].margins for diagram in (one, other))
    print(found, wanted)
