"""How units flow: numbers without a unit, rings of blocks, and that the order of the file does not matter."""

from __future__ import annotations

import random
from typing import Any

import pytest

from quadvis.api import Diagram, load_text
from quadvis.errors import DiagramError
from tests.stages import mostly_slow

HEAD = "quadvis: 1\nname: case\nrates: {c: 10 Hz}\nsolver: {step: 100 ms}\nstop_time: 1 s\nblocks:\n"
RATE = "  per_second: {block: sources.step, rate: c, with: {after: 1 1/s}}\n"
METRES = "  metres: {block: sources.step, rate: c, with: {after: 1 m}}\n"
PLAIN = "  plain: {block: sources.step, rate: c, with: {after: 1}}\n"


def loaded(blocks: str) -> Diagram:
    """Return the diagram of some blocks."""
    return load_text(HEAD + blocks)


def refusals(blocks: str) -> list[tuple[int, str]]:
    """Return what is wrong with a diagram of some blocks: the column and the sentence of each fault."""
    try:
        loaded(blocks)
    except DiagramError as error:
        return [(fault.place.column, str(fault).partition(": ")[2]) for fault in error.faults]
    return []


@pytest.mark.parametrize(
    "block",
    [
        "signal.discrete_integrator, rate: c, with: {upper: 4, initial: 1}, in: {u: per_second.y}",
        "signal.discrete_integrator, rate: c, with: {lower: -4}, in: {u: per_second.y}",
        "signal.discrete_integrator, rate: c, with: {upper: 400 %}, in: {u: per_second.y}",
        "signal.integrator, with: {upper: 4, initial: 1}, in: {u: {from: per_second.y, across: hold}}",
        "signal.integrator, with: {lower: -2, upper: 2}, in: {u: {from: per_second.y, across: hold}}",
        "signal.discrete_integrator, rate: c, with: {upper: 4, initial: 1}, in: {u: plain.y}",
        "signal.discrete_integrator, rate: c, with: {upper: 4 m*s, initial: 0}, in: {u: metres.y}",
        "signal.discrete_integrator, rate: c, with: {initial: 1}, in: {u: 0}",
        "signal.saturation, rate: c, with: {lower: -1, upper: 1}, in: {u: plain.y}",
        "signal.rate_limiter, rate: c, with: {rising: 2, falling: 3, initial: 1}, in: {u: plain.y}",
        "signal.gain, rate: c, with: {factor: 3}, in: {u: metres.y}",
        "signal.unit_delay, rate: c, with: {initial: 1}, in: {u: plain.y}",
        "sources.sine, rate: c, with: {amplitude: 2, bias: 1, frequency: 1 Hz}",
        "sources.ramp, rate: c, with: {initial: 2, slope: 3}",
    ],
)  # fmt: skip
def test_a_number_without_a_unit_is_free_until_the_unit_is_known(block: str) -> None:
    assert refusals(f"{PLAIN}{METRES}{RATE}  x: {{block: {block}}}\n") == []


@pytest.mark.parametrize(
    ("block", "name", "unit"),
    [
        ("signal.discrete_integrator, rate: c, with: {upper: 4}, in: {u: metres.y}", "upper", "m*s"),
        ("signal.discrete_integrator, rate: c, with: {initial: 1}, in: {u: metres.y}", "initial", "m*s"),
        ("signal.discrete_integrator, rate: c, with: {lower: -1}, in: {u: 1 m/s}", "lower", "m"),
        ("signal.integrator, with: {upper: 4}, in: {u: {from: metres.y, across: hold}}", "upper", "m*s"),
        ("signal.saturation, rate: c, with: {lower: -1 m, upper: 1}, in: {u: metres.y}", "upper", "m"),
        ("signal.saturation, rate: c, with: {lower: -1}, in: {u: per_second.y}", "lower", "1/s"),
        ("signal.rate_limiter, rate: c, with: {rising: 2}, in: {u: metres.y}", "rising", "m/s"),
        ("signal.unit_delay, rate: c, with: {initial: 1}, in: {u: metres.y}", "initial", "m"),
        ("sources.step, rate: c, with: {after: 2, before: 1 m}", "after", "m"),
        ("sources.step, rate: c, with: {before: 1 m, after: 2}", "after", "m"),
        ("sources.sine, rate: c, with: {amplitude: 2, bias: 1 V, frequency: 1 Hz}", "amplitude", "V"),
        ("sources.ramp, rate: c, with: {initial: 2, slope: 3 m/s}", "initial", "m"),
        ("signal.difference, rate: c, in: {plus: metres.y, minus: 2}", "minus", "m"),
        ("signal.difference, rate: c, in: {minus: 2, plus: metres.y}", "minus", "m"),
    ],
)
def test_a_number_without_a_unit_is_refused_where_the_signal_has_one(
    block: str, name: str, unit: str
) -> None:
    text = f"  x: {{block: {block}}}"
    ((column, found),) = refusals(f"{PLAIN}{METRES}{RATE}{text}\n")
    assert found == f"block 'x': '{name}' has no unit, its unit here is {unit}; write it in {unit}"
    key = text.index(f"{name}: ")
    assert column - 1 in (key, key + len(f"{name}: "))  # of a parameter the key, of an input the value


@pytest.mark.parametrize("order", range(6))
def test_a_decay_of_a_plain_number_needs_one_unit_only(order: int) -> None:
    blocks = [
        "  x: {block: signal.integrator, with: {initial: 1}, in: {u: k.y}}\n",
        "  k: {block: signal.gain, rate: continuous, with: {factor: -2 1/s}, in: {u: x.y}}\n",
        RATE,
    ]
    random.Random(order).shuffle(blocks)
    diagram = loaded("".join(blocks))
    assert diagram.graph["x"].unit("y") == "1"
    assert diagram.graph["k"].unit("y") == "1/s"


@pytest.mark.parametrize(("controller", "car"), [("a", "b"), ("b", "a")])
def test_a_constant_tells_what_a_gain_read_before_it_needs_to_know(controller: str, car: str) -> None:
    diagram = loaded(
        f"  {controller}:\n    block: systems.pid\n"
        f"    with: {{method: continuous, kp: 800 N*s/m, ki: 40 N/m}}\n"
        f"    in: {{reference: 10 m/s, measurement: {car}.y}}\n"
        f"  {car}:\n    block: systems.transfer_function\n"
        f"    with: {{denominator: [1000, 50], gain: 1 m/s/N}}\n    in: {{u: {controller}.y}}\n"
    )
    assert str(diagram.graph[controller].units["y"][0]) == "N"
    assert str(diagram.graph[car].units["y"][0]) == "m/s"


def test_the_outputs_of_formulas_have_their_units() -> None:
    diagram = load_text(
        f"{HEAD}{METRES}"
        "  law: {block: math.expression, rate: c, with: {force: k * x, k: 2 N/m}, in: {x: metres.y}}\n"
        "expect: [{signal: law.force, below: 3 N}]\n"
        "figures: [{title: force, panels: [{title: force, signals: law.force, unit: kN}]}]\n"
    )
    assert str(diagram.graph["law"].units["force"][0]) == "N"
    assert diagram.run().passed


def test_what_one_ring_says_counts_in_the_next() -> None:
    first = """\
  a: {block: signal.unit_delay, rate: c, with: {initial: 1 m}, in: {u: b.y}}
  b: {block: signal.gain, rate: c, in: {u: a.y}}
"""
    second = """\
  c: {block: signal.unit_delay, rate: c, with: {initial: 1}, in: {u: d.y}}
  d: {block: signal.sum, rate: c, in: {u: [c.y, b.y]}}
"""
    wanted = "block 'c': 'initial' has no unit, its unit here is m; write it in m"
    for blocks in (first + second, second + first):
        assert [text for _, text in refusals(blocks)] == [wanted]


NUMBERS = ["0", "1", "2 m", "3 1/s", "-1 m/s", "0.5", "4 s"]
KINDS: dict[str, tuple[list[str], list[str]]] = {  # parameters and inputs
    "sources.step": (["before", "after"], []),
    "sources.constant": (["value"], []),
    "signal.gain": (["factor"], ["u"]),
    "signal.sum": ([], ["u", "u", "u"]),
    "signal.concatenate": ([], ["u", "u"]),
    "signal.unit_delay": (["initial"], ["u"]),
    "signal.discrete_integrator": (["initial"], ["u"]),
    "signal.rate_limiter": (["rising", "initial"], ["u"]),
    "signal.low_pass": (["initial"], ["u"]),
}


def random_blocks(rng: random.Random) -> list[str]:
    """Return the lines of some blocks, wired at random; rings too."""
    count = rng.randint(3, 8)
    kinds = [rng.choice(list(KINDS)) for _ in range(count)]
    lines = []
    for index, kind in enumerate(kinds):
        params, inputs = KINDS[kind]
        values: dict[str, Any] = {name: rng.choice(NUMBERS) for name in params if rng.random() < 0.6}
        if kind == "sources.constant":
            values = {"value": rng.choice(NUMBERS)}
        if "rising" in values:
            values["rising"] = values["rising"].removeprefix("-")
        sources = [
            rng.choice(NUMBERS) if rng.random() < 0.2 else f"n{rng.randrange(count)}.y" for _ in inputs
        ]
        listed = {"u": f"[{', '.join(sources)}]"} if len(inputs) > 1 else {}
        wires = listed or dict(zip(inputs, sources, strict=True))
        given = ", ".join(f"{name}: {value}" for name, value in values.items())
        wired = ", ".join(f"{name}: {value}" for name, value in wires.items())
        lines.append(f"  n{index}: {{block: {kind}, rate: c, with: {{{given}}}, in: {{{wired}}}}}\n")
    return lines


@pytest.mark.parametrize("seed", mostly_slow(range(150), 15, slow=30))
def test_the_order_of_the_blocks_does_not_matter(seed: int) -> None:
    rng = random.Random(seed)
    lines = random_blocks(rng)
    found = []
    for _ in range(3):
        try:
            graph = loaded("".join(lines)).graph
            found.append(sorted((node.path, str(sorted(node.units.items()))) for node in graph.nodes))
        except DiagramError as error:
            told = [(fault.subject, fault.problem) for fault in error.faults]
            found.append(sorted(pair for pair in told if not pair[1].startswith("algebraic loop")))
        rng.shuffle(lines)
    assert found[0] == found[1] == found[2]
