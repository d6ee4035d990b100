"""Parts that do not always run: enabled, triggered and reset ones, and such parts in each other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import quadvis
from quadvis.api import load_text
from quadvis.engine.engine import Engine

HEAD = """
quadvis: 1
name: test
rates: {fast: 10 Hz, slow: 5 Hz}
solver: {method: ode4, step: 50 ms}
stop_time: 2 s
blocks:
  one: {block: sources.constant, rate: fast, with: {value: 1}}
  time: {block: sources.clock, rate: fast}
"""
PARTS = {
    "sum.yaml": """
quadvis: 1
name: sum
ports: {in: [u], out: {y: total.y}}
blocks:
  total: {block: signal.discrete_integrator, with: {initial: 5 s}, in: {u: in.u}}
""",
    "held.yaml": """
quadvis: 1
name: held
ports: {in: [u], out: {y: copy.y}}
blocks:
  copy: {block: signal.gain, with: {factor: 1}, in: {u: in.u}}
""",
    "fibonacci.yaml": """
quadvis: 1
name: fibonacci
params: {start: 0}
ports: {out: {y: next.y}}
blocks:
  before: {block: signal.unit_delay, with: {initial: 1}, in: {u: next.y}}
  next: {block: signal.sum, in: {u: [before.y, {from: next.y, across: delay}]}}
""",
    "path.yaml": """
quadvis: 1
name: path
ports: {in: [u], out: {y: path.y, square: square.y}}
blocks:
  path: {block: signal.integrator, with: {initial: 2 s^2}, in: {u: {from: in.u, across: hold}}}
  square: {block: math.product, rate: continuous, in: {u: [path.y, path.y]}}
""",
    "nest.yaml": """
quadvis: 1
name: nest
ports: {in: [u, inner], out: {y: inner.y, own: own.y}}
blocks:
  own: {block: signal.discrete_integrator, in: {u: in.u}}
  inner:
    part: sum.yaml
    when: {from: in.inner, states: reset}
    initial: {y: 7 s}
    in: {u: in.u}
""",
}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in PARTS.items():
        Path(name).write_text(text)


def table(name: str, rows: str) -> str:
    """A truth value by its values at the ticks of the fast rate."""
    changes = [k for k in range(len(rows)) if k == 0 or rows[k] != rows[k - 1]]
    values, times = [[float(rows[k])] for k in changes], [round(0.1 * k - 0.05, 2) for k in changes]
    return f"""
  {name}_:
    block: sources.table
    rate: fast
    with: {{values: {values}, times: {{value: {times}, unit: s}}, interpolation: hold}}
  {name}: {{block: logic.compare, rate: fast, with: {{operator: ">"}}, in: {{a: "{name}_.y[0]", b: 0.5}}}}
"""


def run(blocks: str, head: str = HEAD, **options: Any) -> Any:
    return load_text(head + blocks).run(**({"engine": "python"} | options))


def of(result: Any, name: str) -> NDArray[Any]:
    return np.asarray(result[name])


ROWS = "000111100011000111110"
ON = np.array([letter == "1" for letter in ROWS])


def counted(reset: bool) -> list[float]:
    """What a forward integrator of 1 from 5 s has given after each tick, running where ON is true."""
    found, state, shown, before = [], 5.0, 0.0, False
    for on in ON:
        if on:
            state = 5.0 if reset and not before else state
            shown, state = state, state + 0.1
        found.append(shown)
        before = on
    return found


@pytest.mark.parametrize("states", ["held", "reset"])
def test_states_are_held_or_set_back_as_a_part_is_enabled(states: str) -> None:
    part = f"  part: {{part: sum.yaml, rate: fast, when: {{from: on.y, states: {states}}}, in: {{u: one.y}}}}"
    result = run(table("on", ROWS) + part)
    assert of(result, "on.y").tolist() == ON.tolist()
    assert of(result, "part.y") == pytest.approx(counted(states == "reset"), abs=1e-12)


def test_outputs_have_their_initial_value_first_and_are_then_held_or_reset() -> None:
    part = """
  {0}:
    part: sum.yaml
    rate: fast
    when: {{from: on.y, outputs: {0}}}
    initial: {{y: 9 s}}
    in: {{u: one.y}}
"""
    result = run(table("on", ROWS) + part.format("held") + part.format("reset"))
    wanted = np.array(counted(False))
    assert of(result, "held.y") == pytest.approx(np.where(wanted > 0, wanted, 9.0))
    assert of(result, "reset.y") == pytest.approx(np.where(ON, wanted, 9.0))
    assert of(result, "reset/total.y") == pytest.approx(wanted)


def test_a_constant_may_enable_a_part() -> None:
    part = "  part: {part: sum.yaml, rate: fast, when: $auto, in: {u: one.y}}"
    head = HEAD.replace("blocks:", "params: {auto: true}\nblocks:")
    assert of(run(part, head), "part.y")[-1] == pytest.approx(7.0)
    assert of(run(part, head.replace("true", "false")), "part.y").tolist() == [0.0] * 21


def test_continuous_states_stand_still_to_the_bit_while_a_part_is_disabled() -> None:
    part = """
  part: {part: path.yaml, rate: fast, when: {from: on.y, across: hold}, in: {u: time.y}}
"""
    result = run(table("on", ROWS) + part)
    y, times = of(result, "part/path.y"), of(result, "time.y")
    state = 2.0
    for k, on in enumerate(ON):
        if on:
            assert y[2 * k] == pytest.approx(state, abs=1e-12)
            state += 0.1 * times[k]
        else:
            assert y[2 * k] == y[max(2 * k - 1, 0)]


def test_a_part_that_always_runs_is_the_part_itself_to_the_bit() -> None:
    off = "  off: {block: logic.compare, rate: continuous, in: {a: 0, b: 1}}\n"
    last = "  last: {block: signal.integrator, in: {u: part.square}}\n"
    part = "  part: {part: path.yaml, rate: fast, in: {u: time.y}}\n"
    one = run(off + last + part)
    other = run(off + last + part.replace("rate: fast,", "rate: fast, when: true, reset: off.y,"))
    for name in ("part.y", "part.square", "last.y"):
        assert of(one, name).tobytes() == of(other, name).tobytes(), name


def test_a_reset_sets_states_back_at_an_edge_before_the_part_runs() -> None:
    part = "  part: {part: sum.yaml, rate: fast, reset: off.y, in: {u: one.y}}"
    result = run(table("off", "110001100000010000000") + part)
    wanted, state = [], 5.0
    for k in range(21):
        state = 5.0 if k in (5, 13) else state
        wanted.append(state)
        state += 0.1
    assert of(result, "part.y") == pytest.approx(wanted, abs=1e-12)


def test_delays_in_a_part_are_states_too() -> None:
    on = "011110000111111111111"
    part = "  part: {part: fibonacci.yaml, rate: fast, when: on.y, reset: off.y}"
    result = run(table("on", on) + table("off", "0" * 12 + "1" * 9) + part)
    # Both are of the tick before: 1, 2, 4, 8, ... goes on after the pause, then begins again.
    wanted, value = [0.0], 1.0
    for k in range(1, 21):
        if on[k] == "1":
            value = 1.0 if k in (1, 12) else 2 * value
        wanted.append(value)
    assert of(result, "part.y").tolist() == wanted


@pytest.mark.parametrize(
    ("edge", "fits"),
    [("rising", lambda a, b: b > a), ("falling", lambda a, b: b < a), ("either", lambda a, b: a != b)],
)
def test_a_triggered_part_runs_at_edges_alone_and_not_at_the_start(edge: str, fits: Any) -> None:
    rows = "110001100000110000111"
    entry = "part: held.yaml, rate: fast, initial: {y: -1 s}, in: {u: time.y}"
    part = f"  part: {{{entry}, triggered: {edge} on.y}}"
    result = run(table("on", rows) + part)
    held, wanted = -1.0, []
    for k in range(21):
        held = 0.1 * k if k and fits(rows[k - 1], rows[k]) else held
        wanted.append(held)
    assert of(result, "part.y") == pytest.approx(wanted, abs=1e-12)


def test_a_restored_snapshot_makes_no_edge() -> None:
    part = "  part: {part: held.yaml, rate: fast, triggered: on.y, in: {u: time.y}}"
    with Engine(load_text(HEAD + table("on", ROWS) + part).graph) as engine:
        engine.run(5)
        assert engine.read("part/y", "y") == pytest.approx(0.3)
        snapshot = engine.snapshot()
        engine.run(3)
        engine.restore(snapshot)
        engine.run(2)
        assert engine.read("part/when", "active") is False
        assert engine.read("part/y", "y") == pytest.approx(0.3)


def test_a_part_at_several_rates_looks_at_its_condition_at_each() -> None:
    Path("rates.yaml").write_text(
        """
quadvis: 1
name: rates
ports: {in: [u], out: {fast: fast.y, slow: slow.y}}
blocks:
  fast: {block: signal.discrete_integrator, rate: fast, in: {u: in.u}}
  slow: {block: signal.discrete_integrator, rate: slow, in: {u: in.u}}
"""
    )
    wire = "{from: NAME.y, across: sample}"
    when, u = (wire.replace("NAME", name) for name in ("on", "one"))
    part = f"  part: {{part: rates.yaml, when: {when}, in: {{u: {u}}}}}"
    result = run(table("on", "000111111111110000000") + part)
    assert of(result, "part.fast")[-1] == pytest.approx(1.0)  # the 11th of its ticks
    assert of(result, "part.slow")[-1] == pytest.approx(0.8)  # of its own ticks 0.4 to 1.2
    assert of(result, "part/when_slow.active").tolist() == [False, False, *[True] * 5, *[False] * 4]


def test_parts_in_each_other() -> None:
    outer, inner = "111100001111111100001", "111111111100110000111"
    part = """
  part:
    part: nest.yaml
    rate: fast
    when: {from: outer.y, states: reset, outputs: reset}
    initial: {y: -1 s, own: -2 s}
    in: {u: one.y, inner: inner.y}
"""
    result = run(table("outer", outer) + table("inner", inner) + part)
    y, own = [], []
    total, mine, shown, before_outer, before = 5.0, 0.0, 7.0, False, False
    for k in range(21):
        on = outer[k] == "1"
        inside = on and inner[k] == "1"
        if on and not before_outer:
            total, mine = 5.0, 0.0
        if inside and not before:
            total = 5.0
        if inside:
            shown, total = total, total + 0.1
        y.append(shown if on else -1.0)
        own.append(mine if on else -2.0)
        mine += 0.1 * on
        before_outer, before = on, inside
    assert of(result, "part.y") == pytest.approx(y, abs=1e-12)
    assert of(result, "part.own") == pytest.approx(own, abs=1e-12)


EVERYTHING = (
    table("on", ROWS)
    + table("off", "000001100000010001000")
    + """
  a: {part: path.yaml, rate: fast, when: {from: on.y, across: hold, states: reset},
      reset: {from: off.y, across: hold}, in: {u: time.y}}
  b: {part: fibonacci.yaml, rate: fast, when: {from: on.y, outputs: reset}, reset: falling off.y}
  c: {part: held.yaml, rate: fast, triggered: either off.y, initial: {y: 3 s}, in: {u: time.y}}
  d: {part: nest.yaml, rate: fast, when: {from: on.y, states: reset}, in: {u: one.y, inner: off.y}}
  e: {block: signal.integrator, in: {u: {from: a.square}}}
  f: {part: sum.yaml, rate: slow, when: {from: on.y, across: sample}, in: {u: {from: one.y, across: sample}}}
"""
)
SIGNALS = ["a.y", "a.square", "b.y", "c.y", "d.y", "d.own", "e.y", "f.y", "d/inner/when.restart"]


@pytest.mark.slow
def test_machine_code_gives_the_same_bits() -> None:
    one, other = run(EVERYTHING), run(EVERYTHING, engine="native")
    for name in SIGNALS:
        assert of(one, name).tobytes() == of(other, name).tobytes(), name


def test_the_resolved_diagram_gives_the_same_run() -> None:
    diagram = load_text(HEAD + EVERYTHING)
    again = load_text(diagram.resolved)
    assert again.resolved == diagram.resolved
    one, other = diagram.run(engine="python"), again.run(engine="python")
    for name, path in [("a.square", "a/square_.y"), ("d.y", "d/y.y"), ("b.y", "b/y.y")]:
        assert of(one, name).tobytes() == of(other, path).tobytes()


def test_a_run_is_replayed_from_its_log() -> None:
    load_text(HEAD + EVERYTHING).run(log="run.mcap", engine="python")
    found = quadvis.replay("run.mcap")
    assert found.same and found.whole


def test_no_block_runs_slow_at_first_since_warming_leaves_no_condition() -> None:
    program = Engine(load_text(HEAD + EVERYTHING).graph).program
    quiet = program.quiet(frozenset())
    assert program.conditions and not quiet.conditions
    assert not any(task.resets for task in quiet.tasks)
