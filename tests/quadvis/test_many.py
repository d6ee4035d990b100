"""Inputs of any number, and sizes that are sums: from the list in a diagram to the tuple in a method."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from quadvis.api import load, load_text
from quadvis.block import Block, Derived, In, Out, Param, ParameterError, SignalType, parameter_sizes
from quadvis.diagram.picture import draw_diagram
from quadvis.diagram.schema import diagram_schema
from quadvis.errors import DiagramError
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import description, facts
from quadvis.testing import drive
from quadvis.testing.conformance import CHECKS, Subject
from quadvis_blocks.signal.concatenate import Concatenate
from quadvis_blocks.signal.sum import Sum

HEAD = """quadvis: 1
name: many
rates: {fast: 10 Hz, slow: 5 Hz}
stop_time: 0.3 s
params: {offset: 3 m}
blocks:
  x: {block: sources.ramp, rate: fast, with: {slope: 1 m/s}}
  v: {block: sources.constant, rate: fast, with: {value: {value: [1, 2], unit: m rad}}}
"""
SUM = '  s: {block: signal.sum, rate: fast, with: {signs: "+-+"}, in: {u: [x.y, $offset, "v.y[0]"]}}\n'
JOIN = "  c: {block: signal.concatenate, rate: fast, in: {u: [s.y, v.y, 5 s, {from: x.y, across: delay}]}}\n"


def loaded(blocks: str) -> Any:
    return load_text(HEAD + blocks, Path.cwd())


def problems(blocks: str) -> list[str]:
    with pytest.raises(DiagramError) as caught:
        loaded(blocks)
    column = len(HEAD.splitlines())
    return [f"{fault.place.line - column}:{fault.place.column} {fault}" for fault in caught.value.faults]


def test_signals_constants_parameters_and_crossings_stand_in_one_list() -> None:
    result = loaded(SUM + JOIN).run()
    assert np.allclose(result["s.y"], [-2.0, -1.9, -1.8, -1.7])
    wanted = [[-2.0, 1, 2, 5, 0.0], [-1.9, 1, 2, 5, 0.0], [-1.8, 1, 2, 5, 0.1], [-1.7, 1, 2, 5, 0.2]]
    assert np.allclose(result["c.y"], wanted)
    assert result.units["c.y"] == "m m rad s m"


def test_each_entry_may_cross_between_rates_by_itself() -> None:
    blocks = "  s: {block: signal.sum, rate: slow, in: {u: [{from: x.y, across: sample}, 1 m]}}\n"
    assert np.allclose(loaded(blocks).run()["s.y"], [1.0, 1.2])
    (problem,) = problems(blocks.replace("{from: x.y, across: sample}", "x.y"))
    assert "'x.y' (fast, 10 Hz) into 'u[0]' (slow, 5 Hz): the wire does not say how it crosses" in problem


def test_one_signal_needs_no_list() -> None:
    assert np.allclose(loaded("  s: {block: signal.sum, rate: fast, in: {u: x.y}}\n").run()["s.y"][-1], 0.3)


def test_a_diagram_written_out_has_the_lists_and_the_same_run() -> None:
    diagram = loaded(SUM + JOIN)
    again = load_text(diagram.resolved, Path.cwd())
    assert again.hash == diagram.hash
    assert np.array_equal(again.run()["c.y"], diagram.run()["c.y"])
    assert "u: [x.y, 3.0 m, 'v.y[0]']" in diagram.resolved


@pytest.mark.parametrize(
    ("source", "problem"),
    [
        ("[]", "input 'u' has no signal; list one at least"),
        ("[x.y, 3 s]", "'u[1]' has s, its unit here is m; write it in m"),
        (
            "[x.y, v.y]",
            "input 'u[1]' takes one value, 'v.y' has 2 values; choose an element, such as 'v.y[0]'",
        ),
        ("[x.y, z.y]", "there is no block 'z'"),
        ("[x.y, true]", "'true' is no number"),
        ("[x.y, [x.y]]", "this input takes one signal, not a list of them"),
    ],
)
def test_a_fault_of_an_entry_stands_at_its_place(source: str, problem: str) -> None:
    text = f"  s: {{block: signal.sum, rate: fast, in: {{u: {source}}}}}"
    found = problems(text + "\n")
    assert len(found) == 1, found
    place, _, words = found[0].partition(" ")
    assert problem in words or "number" in problem, words
    last = source.rindex(",") + 2 if "," in source else 0
    assert place == f"1:{text.index(source) + last + 1}"


def test_a_list_for_an_input_that_takes_one_signal_names_the_remedy() -> None:
    (problem,) = problems("  g: {block: signal.gain, rate: fast, in: {u: [x.y, x.y]}}\n")
    assert (
        "this input takes one signal, not a list of them; join them with a block 'signal.concatenate'"
        in problem
    )
    assert [
        "has no input 'w'" in problem
        for problem in problems("  g: {block: signal.gain, rate: fast, in: {u: x.y, w: [x.y, x.y]}}\n")
    ] == [True]


def test_nothing_wired_is_a_fault() -> None:
    (problem,) = problems("  s: {block: signal.sum, rate: fast}\n")
    assert "input 'u' is not connected" in problem


def test_a_number_of_signals_that_contradicts_a_parameter_stands_at_the_parameter() -> None:
    (problem,) = problems(
        '  s: {block: signal.sum, rate: fast, with: {signs: "+-"}, in: {u: [x.y, x.y, x.y]}}\n'
    )
    assert "signs must be + or - for each signal of 3, got '+-'" in problem
    assert problem.startswith(f"1:{len('  s: {block: signal.sum, rate: fast, with: {signs: ') + 1} ")


def test_a_parameter_in_a_list_is_used_and_cannot_be_tuned_through_it() -> None:
    diagram = loaded(SUM)
    assert not diagram.warnings
    assert diagram.knobs["offset"].elsewhere == ("the input 's.u'",)


def test_a_run_by_hand_reads_an_entry() -> None:
    with loaded(SUM).start() as run:
        run.advance("0.2 s")
        assert run["s.u[1]"] == 3.0
        assert run["s.u[2]"] == 1.0


def test_a_picture_shows_each_entry() -> None:
    picture = draw_diagram(loaded(SUM))
    assert all(f'data-target="s.u[{number}]"' in picture for number in (0, 2))
    assert picture.count('class="outline"') == 3 and "<circle" in picture


def test_a_slot_takes_the_list_of_the_block_before_it(tmp_path: Path) -> None:
    text = SUM.replace("s: {block", "s: {slot: true, block")
    variants = "variants: {plain: {slots: {s: {block: signal.sum}}}}\n"
    (tmp_path / "many.yaml").write_text(HEAD + text + variants)
    assert np.allclose(load(tmp_path / "many.yaml", variant="plain").run()["s.y"][0], 4.0)


def test_editors_know_the_list() -> None:
    schema = diagram_schema({"signal.sum": Sum, "signal.concatenate": Concatenate})
    form = schema["$defs"]["block:signal.sum"]["properties"]["in"]["properties"]["u"]
    assert form["description"] == "the terms (float64[*], a, any number)"
    whole = {"$defs": schema["$defs"], **form}
    for right in (["a.y", {"from": "b.y", "across": "hold"}, 3], "a.y"):
        jsonschema.validate(right, whole)
    for wrong in ([], [{"form": "a.y"}]):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, whole)


def test_describe_says_any_number() -> None:
    text = description("signal.sum", Catalogue().find("signal.sum"))
    assert "u  [*] a  any number  the terms" in text
    assert "in: {first: block.port, u: [block.port, block.port]}" in description("weighted", Weighted)
    assert facts("signal.sum", Sum)["inputs"]["u"]["many"] is True


@pytest.mark.slow
def test_machine_code_gives_the_same_bits_for_any_number() -> None:
    rng = np.random.default_rng(3)
    for count in (1, 2, 5):
        terms = [rng.normal(size=20) for _ in range(count)]
        for block in (Sum, Concatenate):
            plain, native = (drive(block(), u=terms, engine=engine).y for engine in ("python", "native"))
            assert np.array_equal(plain, native)


class Weighted(Block):
    """Weighted terms, and how many there are."""

    first = In(doc="the first term")
    u = In(unit="a", many=True, doc="terms")
    last = In(default=0.0, doc="the last term")
    weight = Param(2.0, doc="of each term")
    y = Out(unit="a", doc="the sum")
    count = Out("int64", doc="how many")
    weights = Derived("float64[u]")

    def check(self) -> None:
        """Make the weights."""
        self.weights = np.full(self.entry_counts.get("u", 1), self.weight)

    def output(self, first, last, *u):
        """Return the sum."""
        total = first + last
        for place, term in enumerate(u):
            total += self.weights[place] * term
        return total, len(u)


def test_a_method_gets_a_tuple_beside_other_inputs() -> None:
    driven = drive(Weighted(weight=3.0), first=1.0, u=[[1.0, 2.0], 10.0], last=100.0)
    assert driven.y.tolist() == [134.0, 137.0] and driven.count.tolist() == [2, 2]


def test_the_inputs_of_a_class_stand_in_the_order_of_its_declarations() -> None:
    block = Weighted().with_entries(u=2)
    assert list(block.interface.inputs) == ["first", "u[0]", "u[1]", "last"]
    assert block.interface.feedthrough == {"first", "u[0]", "u[1]", "last"}
    assert parameter_sizes(block) == {"u": 2}
    assert list(Weighted.interface.inputs) == ["first", "u", "last"] and Weighted.interface.many == ("u",)


def test_one_class_serves_all_blocks_with_as_many_signals() -> None:
    assert Weighted.with_ports({}, {"u": 2}) is type(Weighted(weight=5.0).with_entries(u=2))
    assert Weighted.with_ports({}, {"u": 2}).with_ports({}, {"u": 3}) is Weighted.with_ports({}, {"u": 3})
    assert Weighted.with_ports({}) is Weighted


def test_conformance_tries_one_two_and_three_signals(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = [list(each.block.interface.inputs)[1:-1] for each in Subject(Weighted).of_any_number((1, 2, 3))]
    assert seen == [["u[0]"], ["u[0]", "u[1]"], ["u[0]", "u[1]", "u[2]"]]
    for name in ("output_changes_nothing", "repeats_after_restore", "returns_what_it_declares", "documented"):
        CHECKS[name](Subject(Weighted))
    (three,) = Subject(Sum, {"signs": "+-+"}).of_any_number((1, 2, 3))
    assert len(three.block.interface.inputs) == 3
    with pytest.raises(AssertionError, match="u must take one of"):
        Subject(Sum, {"signs": "+-+-+"}).of_any_number((1, 2, 3))


@pytest.mark.parametrize(
    ("members", "problem"),
    [
        ({"u": In(many=True), "output": lambda self, u: 0.0}, "asks for 'u'; write '\\*u'"),
        ({"u": In(), "output": lambda self, *u: 0.0}, "asks for '\\*u'; write 'u'"),
    ],
)
def test_a_method_asks_for_any_number_with_a_star(members: dict[str, Any], problem: str) -> None:
    with pytest.raises(TypeError, match=problem):
        type("Wrong", (Block,), {"y": Out(), **members})


def test_declarations_that_say_nothing_are_refused() -> None:
    with pytest.raises(
        TypeError, match=r"Wrong\.u takes any number of signals, one at least; leave out 'default'"
    ):
        type("Wrong", (Block,), {"u": In(many=True, default=0.0)})
    with pytest.raises(TypeError, match="of a sum nobody knows the parts"):
        In("float64[m+n]")
    for wrong in (lambda: Out("float64[n?]"), lambda: In("float64[*?]"), lambda: Param(type="float64[n?]")):
        with pytest.raises(TypeError, match=r"only a parameter can be \[\*\?\], only an input \[n\?\]"):
            wrong()
    with pytest.raises(TypeError, match="is not a signal type"):
        SignalType.parse("float64[m,n?]")


def test_sums_of_sizes_follow_from_their_parts() -> None:
    signal = SignalType.parse("float64[m+n+1,m]")
    assert signal.symbols == ("m", "n", "m") and signal.is_sum
    assert signal.resolve({"m": 2, "n": 3}) == (6, 2)
    assert SignalType.parse("float64[m+n]").parts({"m": 2, "n": 3}) == (2, 3)
    assert str(signal) == "float64[m+n+1,m]"


def test_an_optional_axis_takes_a_scalar_as_one_element() -> None:
    sizes: dict[str, Any] = {}
    assert SignalType.parse("float64[n?]").unify((), sizes) and sizes == {"n": 1}
    assert SignalType.parse("float64[*?]").unify((), {"*": (3,)})
    assert not SignalType.parse("float64[*?]").unify((2,), {"*": (3,)})
    assert not SignalType.parse("float64[n?]").unify((2, 2), {})


def test_units_of_elements_go_through_a_ring_of_joined_signals() -> None:
    blocks = """\
  both: {block: signal.concatenate, rate: fast, in: {u: [place.y, speed.y]}}
  speed: {block: signal.discrete_integrator, rate: fast, with: {initial: 1 m/s}, in: {u: pull.y}}
  place: {block: signal.discrete_integrator, rate: fast, in: {u: "both.y[1]"}}
  pull: {block: signal.gain, rate: fast, with: {factor: -1 1/s^2}, in: {u: "both.y[0]"}}
"""
    assert loaded(blocks).run().units["both.y"] == "m m/s"


def test_a_wrong_parameter_of_ports_is_a_parameter_error() -> None:
    class Chosen(Block):
        """A block with ports of its own."""

        signs = Param("", type="str", doc="signs")
        u = In(many=True, doc="terms")

        @classmethod
        def ports(cls, u: int, signs: str) -> dict[str, Any]:
            """Refuse all but as many signs."""
            if len(signs) != u:
                raise ParameterError("signs", "signs must be as many")
            return {
                "u": [In(unit="m" if sign == "+" else "s", doc="term") for sign in signs],
                "y": Out(doc="y"),
            }

        def output(self, *u: float) -> float:
            """Return the sum."""
            return sum(u)

    assert drive(Chosen(signs="+-"), u=[[1.0], [2.0]]).y.tolist() == [3.0]
    with pytest.raises(ParameterError, match="signs must be as many"):
        drive(Chosen(signs="+"), u=[[1.0], [2.0]])


def test_an_entry_may_come_over_a_link_from_another_computer() -> None:
    text = """quadvis: 1
name: two
computers: {near: {}, far: {}}
rates: {fast: 10 Hz}
stop_time: 0.2 s
blocks:
  x: {block: sources.ramp, rate: fast, at: near, with: {slope: 1 m/s, initial: 5 m}}
  s: {block: signal.sum, rate: fast, at: far, in: {u: [1 m, {from: x.y, initial: 2 m}]}}
  c: {block: signal.concatenate, rate: fast, at: far, in: {u: [s.y, {from: x.y, initial: 2 m}]}}
"""
    diagram = load_text(text, Path.cwd())
    result = diagram.run()
    assert result["s.y"] == pytest.approx([3.0, 6.0, 6.1])
    assert result["c.y"][0].tolist() == [3.0, 2.0]
    assert load_text(diagram.resolved, Path.cwd()).hash == diagram.hash


def test_entries_of_other_tasks_are_latched_where_tasks_run_by_themselves() -> None:
    blocks = """\
  s:
    block: signal.sum
    rate: slow
    in: {u: [{from: x.y, across: sample}, {from: b.y, across: delay}]}
  b: {block: signal.gain, rate: fast, in: {u: {from: s.y, across: hold}}}
"""
    diagram = load_text(HEAD.replace("params", "tasking: multi\nparams") + blocks, Path.cwd())
    wires = dict(diagram.graph["s"].wires())
    assert wires["u[0]"].latched and wires["u[1]"].delayed
    assert diagram.run()["s.y"][0] == 0.0


def test_what_is_expected_of_a_list_s_output_is_judged_and_shown(tmp_path: Path) -> None:
    text = (
        "quadvis: 1\nname: all\nrates: {fast: 10 Hz}\nstop_time: 1 s\nblocks:\n"
        "  one: {block: sources.constant, rate: fast, with: {value: 1 m}}\n"
        "  two: {block: sources.constant, rate: fast, with: {value: 2 m}}\n"
        "  all: {block: signal.concatenate, rate: fast, in: {u: [one.y, two.y]}}\n"
        "expect:\n  - {signal: all.y, within: 1.5 m}\n  - {signal: 'all.y[0]', within: 1.5 m}\n"
        "summary: {all: {signal: all.y, show: [final]}}\n"
        "figures: [{title: All, signals: all.y}]\n"
    )
    diagram = load_text(text, tmp_path)
    result = diagram.run()
    assert [verdict.met for verdict in result.outcome.verdicts] == [False, True]
    assert result.outcome.summary["all"]["final"] == (1.0, 2.0)
    assert not result.passed
