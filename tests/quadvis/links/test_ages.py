"""Ages of what a block acts on: measured along its path, as closed forms say, and stated before a run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quadvis.analysis.ages import worst_age, worst_ages
from quadvis.api import Diagram, load_text
from quadvis.graph.graph import MULTI, SINGLE
from quadvis.links.stamps import AgeMeter, StampHolder, StampKeeper
from quadvis.testing import drive

CHAIN = """
quadvis: 1
name: chain
rates: {fast: 100 Hz, control: 20 Hz, vision: 10 Hz, odd: {rate: 10 Hz, offset: 30 ms}}
stop_time: 4 s
TASKING
NETWORK
blocks:
  clock: {block: sources.ramp, rate: vision, EYE with: {slope: 1 s/s}}
  pose: {block: signal.gain, rate: vision, EYE with: {factor: 1 m/s}, in: {u: clock.y}}
  law: {block: signal.gain, rate: control, BRAIN in: {u: {from: pose.y, across: hold}}}
  keep: {block: signal.unit_delay, rate: control, BRAIN in: {u: law.y}}
  late: {block: signal.gain, rate: odd, BRAIN in: {u: {from: pose.y, across: newest}}}
  out: {block: signal.gain, rate: fast, WORLD in: {u: {from: keep.y, across: hold}}}
log: {signals: [clock]}
expect:
  - {age: [clock.y, law], below: 1 s, after: 1 s}
  - {age: [clock.y, late.y], below: 1 s, after: 1 s}
  - {age: [clock.y, out], below: 180 ms, after: 1 s}
"""
COMPUTERS = """
computers: {eye: {}, brain: {}, world: {}}
links: {line: {from: eye, to: brain, via: serial, baud: 9600 MORE}}
"""
AT = {"EYE": "eye", "BRAIN": "brain", "WORLD": "world"}


def chain(tasking: str = SINGLE, *, apart: bool, more: str = "") -> Diagram:
    """Return the chain on one computer, or on three."""
    text = CHAIN.replace("TASKING", f"tasking: {tasking}")
    text = text.replace("NETWORK", COMPUTERS.replace("MORE", more) if apart else "")
    for word, name in AT.items():
        text = text.replace(f"{word} ", f"at: {name}, " if apart else "")
    return load_text(text)


# From the tick of the clock to that of the block, at best and at worst (s). A frame of 33 bytes takes 34 ms.
# On one computer law acts at once; keep gives it 50 ms later; the next 100 ms pass without anything new.
CASES = [
    (SINGLE, False, {"law": (0.0, 0.05), "late.y": (0.03, 0.03), "out": (0.05, 0.14)}),
    # A slower task's value comes one of its periods later.
    (MULTI, False, {"law": (0.1, 0.15), "late.y": (0.03, 0.03), "out": (0.2, 0.29)}),
    # With links: law at 50 ms, keep at 100 ms, out one tick later.
    (SINGLE, True, {"law": (0.05, 0.1), "late.y": (0.13, 0.13), "out": (0.11, 0.2)}),
]


@pytest.mark.parametrize(("tasking", "apart", "wanted"), CASES, ids=["single", "multi", "links"])
def test_ages_are_those_of_the_path(
    tasking: str, apart: bool, wanted: dict[str, tuple[float, float]]
) -> None:
    diagram = chain(tasking, apart=apart)
    result = diagram.run()
    for verdict, (name, (least, most)) in zip(result.outcome.verdicts, wanted.items(), strict=True):
        assert str(verdict.expectation).startswith(f"age of clock.y at {name} ")
        signal = verdict.expectation.selection.name
        ages = result[signal][result.times(signal) >= 1.0]
        assert (ages.min(), ages.max()) == pytest.approx((least, most))
        assert verdict.found == pytest.approx(most)
        assert worst_age(diagram.graph, signal.removesuffix(".age")) == pytest.approx(most)
    assert [verdict.met for verdict in result.outcome.verdicts] == [True, True, wanted["out"][1] < 0.18]


def test_ages_are_logged_whatever_else_is_and_hold_up_nothing() -> None:
    diagram = chain(apart=True)
    result = diagram.run()
    assert sorted(result) == [
        "age/clock_y/late.age", "age/clock_y/law.age", "age/clock_y/out.age", "clock.y",
    ]  # fmt: skip
    assert "held_stamp" not in diagram.resolved
    again = load_text(diagram.resolved)
    assert again.hash == diagram.hash and again.resolved == diagram.resolved
    plain = load_text(CHAIN.partition("expect:")[0].replace("TASKING", "").replace("NETWORK", "").replace(
        "EYE ", "").replace("BRAIN ", "").replace("WORLD ", "")).run()  # fmt: skip
    np.testing.assert_array_equal(plain["clock.y"], result["clock.y"])


def test_the_worst_age_has_the_greatest_jitter_and_no_losses() -> None:
    plain, late = (chain(apart=True, more=more) for more in ("", ", jitter: 70 ms, loss: 50 %"))
    found = [
        {str(each).partition(":")[0]: each.greatest for each in worst_ages(one)} for one in (plain, late)
    ]
    assert found[0]["age of clock.y at law"] == pytest.approx(0.1)
    # 34 ms and up to 70 ms more: it comes at the tick of 150 ms, and stays for 100 ms.
    assert found[1]["age of clock.y at law"] == pytest.approx(0.2)
    assert str(worst_ages(plain)[2]) == (
        "age of clock.y at out: at most 200 ms from the tick at which the stamp is given (limit 180 ms)"
    )


def test_the_stamp_travels_in_the_frames_of_the_link() -> None:
    links = chain(apart=True).links
    signals = {link.name: [signal.name for signal in link.message.signals] for link in links}
    assert signals == {"line": ["held_stamp", "y"], "brain_to_world_control": ["held_stamp", "y"]}


def test_an_age_at_the_block_that_gives_the_stamp() -> None:
    text = CHAIN.partition("expect:")[0] + "expect: [{age: [clock.y, clock], below: 1 ms}]"
    for word in ("TASKING", "NETWORK", "EYE ", "BRAIN ", "WORLD "):
        text = text.replace(word, "")
    result = load_text(text).run()
    assert result.passed and result.outcome.verdicts[0].found == 0.0


NAN, INF = math.nan, math.inf


def test_a_holder_gives_the_last_stamp_and_a_keeper_that_of_one_tick_ago() -> None:
    stamps = [NAN, 0.1, NAN, -INF, 0.4]
    held = drive(StampHolder(), stamp=stamps).held_stamp
    kept = drive(StampKeeper(), stamp=stamps).held_stamp
    np.testing.assert_array_equal(held, [0.0, 0.1, 0.1, 0.1, 0.4])
    np.testing.assert_array_equal(kept, [0.0, 0.0, 0.1, 0.1, 0.1])


def test_a_stamp_of_a_camera_that_errs_ends_no_run() -> None:
    ages = drive(AgeMeter(), stamp=[NAN, 0.05, INF, -INF, NAN], rate="10 Hz").age
    np.testing.assert_allclose(ages, [0.0, 0.05, 0.15, 0.25, 0.35])
