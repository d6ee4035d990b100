"""Loading as a whole: right diagrams are loaded, and every other text gives faults and nothing else."""

from __future__ import annotations

import cProfile
import math
import os
import pstats
import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import quadvis
from quadvis.api import check, load, load_text
from quadvis.document import MAX_BYTES
from quadvis.errors import DiagramError, Faults
from quadvis.graph.graph import Constant, Wire

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
HOVER = (DIAGRAMS / "hover.yaml").read_text(encoding="utf-8")

SMALL = """\
quadvis: 1
name: small
params: {height: 1.5 m, place: {value: [1, 20, 3], unit: "m cm m"}, factor: 3}
rates: {fast: 100 Hz, slow: 10 Hz}
stop_time: 1 s
seed: 7
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: $height, bias: "$place[1]", frequency: 50 1/s}}
  place: {block: sources.constant, rate: slow, with: {value: $place}}
  pair: {block: sources.constant, rate: slow, with: {value: {value: [$factor, $height], unit: cm}}}
  leaf: {part: leaf.yaml, rate: slow, with: {size: $factor}, in: {u: place.y, v: {value: $factor, unit: km}}}
"""

LEAF = """\
quadvis: 1
name: leaf
params: {size: 2, rest: [1, 2]}
ports: {in: [u, v], out: {y: scaled.y}}
blocks:
  scaled: {block: signal.gain, with: {factor: $size}, in: {u: "in.u[0:2]"}}
  far: {block: signal.gain, with: {factor: "$rest[1]"}, in: {u: in.v}}
"""


@pytest.fixture
def small(tmp_path: Path) -> Callable[..., quadvis.Diagram]:
    (tmp_path / "small.yaml").write_text(SMALL)
    (tmp_path / "leaf.yaml").write_text(LEAF)
    return lambda **options: load(tmp_path / "small.yaml", **options)


def told(error: DiagramError) -> list[str]:
    return [fault.problem for fault in error.faults]


def test_parameters_are_replaced_wherever_a_value_may_stand(small: Callable[..., quadvis.Diagram]) -> None:
    graph = small().graph
    assert graph["wave"].block.amplitude == 1.5
    assert graph["wave"].block.bias == 0.2
    assert graph["wave"].block.frequency == 50
    np.testing.assert_array_equal(graph["place"].block.value, [1, 0.2, 3])
    np.testing.assert_allclose(graph["leaf/scaled"].block.factor, 3)
    assert graph["leaf/far"].block.factor == 2
    assert graph["leaf/far"].inputs["u"] == Constant(3000.0)
    assert graph["leaf/scaled"].inputs["u"] == Wire("place", "y", (slice(0, 2),))


def test_a_unit_beside_a_list_serves_the_numbers_that_have_none(
    small: Callable[..., quadvis.Diagram],
) -> None:
    with pytest.raises(DiagramError) as caught:
        small(settings=["height=3 s"])
    # A parameter that brings its own unit keeps it: 3 s beside centimetres is the fault, 3 is in centimetres.
    assert told(caught.value) == ["'bias' has m, its unit here is s"]
    np.testing.assert_allclose(small().graph["pair"].block.value, [0.03, 1.5])


@pytest.mark.parametrize(
    ("setting", "path", "name", "value"),
    [
        ("height=2 m", "wave", "amplitude", 2.0),
        ("place=[1 m, 2 m, 3 m]", "wave", "bias", 2.0),
        ("leaf.size=5", "leaf/scaled", "factor", 5.0),
        ("leaf/scaled.factor=6", "leaf/scaled", "factor", 6.0),
        ("wave.frequency={value: 2, unit: kHz}", "wave", "frequency", 2000.0),
    ],
)
def test_settings_reach_the_diagram_its_parts_and_inner_blocks(
    small: Callable[..., quadvis.Diagram], setting: str, path: str, name: str, value: float
) -> None:
    assert getattr(small(settings=[setting]).graph[path].block, name) == value
    key, _, text = setting.partition("=")
    assert getattr(small(settings={key: text}).graph[path].block, name) == value


def test_settings_may_be_numbers_and_arrays(small: Callable[..., quadvis.Diagram]) -> None:
    diagram = small(settings={"leaf.size": 4, "place.value": np.array([1.0, 2.0]), "leaf.rest": [1, 2.5]})
    assert diagram.graph["leaf/scaled"].block.factor == 4
    np.testing.assert_array_equal(diagram.graph["place"].block.value, [1, 2])
    assert diagram.graph["leaf/far"].block.factor == 2.5


def test_the_last_of_two_settings_counts(small: Callable[..., quadvis.Diagram]) -> None:
    assert small(settings=["leaf.size=4", "leaf.size=5"]).graph["leaf/scaled"].block.factor == 5


def test_stop_time_and_seed_are_those_of_the_file_unless_given(small: Callable[..., quadvis.Diagram]) -> None:
    assert (small().duration, small().seed) == (1.0, 7)
    diagram = small(stop_time="250 ms", seed=3)
    assert (diagram.duration, diagram.seed) == (0.25, 3)
    assert small(stop_time=np.float64(0.5)).duration == 0.5
    assert small(stop_time=2).duration == 2.0


@pytest.mark.parametrize("stop_time", [-1, float("nan"), float("inf"), 1e30, "soon", ""])
def test_a_stop_time_that_is_none_is_a_fault(
    small: Callable[..., quadvis.Diagram], stop_time: float | str
) -> None:
    with pytest.raises(DiagramError) as caught:
        small(stop_time=stop_time)
    assert [fault.place.file for fault in caught.value.faults] == ["stop_time"]


def test_the_first_and_the_last_tick_are_run(small: Callable[..., quadvis.Diagram]) -> None:
    times = small().run().times("wave.y")
    assert (len(times), times[0], times[-1]) == (101, 0.0, 1.0)


def test_a_path_is_relative_to_the_file_in_which_it_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera = (DIAGRAMS / "calib" / "camera.yaml").read_text()
    for folder in ("", "parts", "elsewhere"):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / f"camera{folder}.yaml").write_text(camera)
    centres = "{value: [[0, 0], [9, 0], [9, 9], [0, 9]], unit: px}"
    pose = f"block: vision.pose_n_points, rate: fast, in: {{centres: {centres}}}"
    (tmp_path / "parts" / "part.yaml").write_text(
        "quadvis: 1\nname: part\nports: {}\n"
        "params: {inner: cameraparts.yaml, outer: cameraparts.yaml}\nblocks:\n"
        f"  a: {{{pose}, with: {{calibration: $inner}}}}\n  b: {{{pose}, with: {{calibration: $outer}}}}\n"
    )
    (tmp_path / "main.yaml").write_text(
        "quadvis: 1\nname: main\nrates: {fast: 10 Hz}\nstop_time: 1 s\nblocks:\n"
        "  part: {part: parts/part.yaml, rate: fast, with: {outer: camera.yaml}}\n"
        f"  pose: {{{pose}, with: {{calibration: camera.yaml}}}}\n"
    )
    monkeypatch.chdir(tmp_path / "elsewhere")
    graph = load("../main.yaml", settings=["pose.calibration=cameraelsewhere.yaml"]).graph
    files = {path: Path(graph[path].block.calibration).resolve() for path in ("part/a", "part/b", "pose")}
    assert files == {
        "part/a": tmp_path / "parts" / "cameraparts.yaml",
        "part/b": tmp_path / "camera.yaml",
        "pose": tmp_path / "elsewhere" / "cameraelsewhere.yaml",
    }


def test_a_variant_takes_the_wires_and_the_rate_of_its_slot(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(
        "quadvis: 1\nname: case\nrates: {fast: 10 Hz, slow: 1 Hz}\nstop_time: 1 s\nblocks:\n"
        "  wave: {block: sources.sine, rate: fast}\n"
        "  law: {slot: true, block: signal.gain, rate: fast, in: {u: wave.y}}\n"
        "variants:\n  held: {slots: {law: {block: signal.unit_delay}}}\n"
        "  slow: {slots: {law: {block: signal.gain, rate: slow, in: {u: {from: wave.y, across: sample}}}}}\n"
    )
    held = load(tmp_path / "case.yaml", variant="held").graph["law"]
    slow = load(tmp_path / "case.yaml", variant="slow").graph["law"]
    assert (held.kind, held.task.name, held.inputs) == ("signal.unit_delay", "fast", {"u": Wire("wave", "y")})
    assert (slow.kind, slow.task.name) == ("signal.gain", "slow")


def test_without_rates_but_with_a_solver_blocks_are_continuous(tmp_path: Path) -> None:
    text = (
        "quadvis: 1\nname: lag\nsolver: {step: 10 ms}\nstop_time: 1 s\nblocks:\n"
        "  error: {block: signal.sum, with: {signs: +-}, in: {u: [1, lag.y]}}\n"
        "  rate: {block: signal.gain, with: {factor: 1 1/s}, in: {u: error.y}}\n"
        "  lag: {block: signal.integrator, in: {u: rate.y}}\n"
    )
    diagram = load_text(text, tmp_path)
    assert {node.task.name for node in diagram.graph.nodes} == {"continuous"}
    assert diagram.run()["lag.y"][-1] == pytest.approx(1.0 - math.exp(-1.0), abs=1e-9)
    clock = "quadvis: 1\nname: c\nstop_time: 1 s\n{}blocks: {{c: {{block: sources.clock}}}}\n"
    assert load_text(clock.format("solver: {step: 10 ms}\n"), tmp_path).graph["c"].task.continuous
    for others in ("rates: {slow: 1 Hz}\nsolver: {step: 10 ms}\n", ""):  # a choice; none at all
        with pytest.raises(DiagramError, match="block 'c': key 'rate' is missing"):
            load_text(clock.format(others), tmp_path)


@pytest.mark.parametrize(
    ("values", "unit"),
    [
        ("[[1, 1], [1, 0]]", "1"),
        ("[[1 m, 2 m], [0, 3 m]]", "m"),
        ("[[0, 2 m], [1 m, 3 m]]", "m"),
        ("[[1 m, 2 s, 0], [2 m, 3 s, 0]]", "m s 1"),
    ],
)
def test_a_plain_zero_has_the_unit_of_the_numbers_beside_it_if_they_agree(
    tmp_path: Path, values: str, unit: str
) -> None:
    (tmp_path / "case.yaml").write_text(
        "quadvis: 1\nname: case\nrates: {fast: 10 Hz}\nstop_time: 1 s\nblocks:\n"
        f"  rows: {{block: sources.table, rate: fast, with: {{times: [0 s, 1 s], values: {values}}}}}\n"
        "  gain: {block: signal.gain, rate: fast, in: {u: rows.y}}\n"
    )
    diagram = load(tmp_path / "case.yaml")
    assert diagram.graph["gain"].unit("y") == unit
    assert load_text(diagram.resolved, tmp_path).hash == diagram.hash


def test_a_variant_builds_on_another_and_goes_before_it(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(
        "quadvis: 1\nname: case\nrates: {fast: 100 Hz}\nstop_time: 1 s\nblocks:\n"
        "  wave: {slot: true, block: sources.sine, rate: fast}\n"
        "  law: {slot: true, block: signal.gain, rate: fast, in: {u: wave.y}}\n"
        "variants:\n"
        "  both:\n    base: ramped\n"
        "    slots: {law: {block: signal.difference, in: {plus: wave.y, minus: wave.y}}}\n"
        "  ramped: {slots: {wave: {block: sources.ramp}, law: {block: signal.unit_delay}}}\n"
    )
    kinds = {name: [type(load(tmp_path / "case.yaml", variant=name).graph[block].block).__name__
                    for block in ("wave", "law")] for name in ("both", "ramped")}  # fmt: skip
    assert kinds == {"both": ["Ramp", "Difference"], "ramped": ["Ramp", "UnitDelay"]}


def test_what_a_variant_leaves_out_is_that_of_the_variant_on_which_it_builds(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(
        "quadvis: 1\nname: case\nrates: {fast: 10 Hz, slow: 1 Hz}\nstop_time: 1 s\nblocks:\n"
        "  wave: {block: sources.sine, rate: fast}\n"
        "  law: {slot: true, block: signal.gain, rate: fast, in: {u: wave.y}}\n"
        "variants:\n"
        "  slow: {slots: {law: {block: signal.gain, rate: slow, in: {u: {from: wave.y, across: sample}}}}}\n"
        "  slow_twice: {base: slow, slots: {law: {block: signal.gain, with: {factor: 2}}}}\n"
    )
    law = load(tmp_path / "case.yaml", variant="slow_twice").graph["law"]
    assert (law.block.factor, law.task.name, law.inputs) == (
        2.0,
        "slow",
        load(tmp_path / "case.yaml", variant="slow").graph["law"].inputs,
    )


@pytest.mark.parametrize("path", sorted(DIAGRAMS.glob("*.yaml")), ids=lambda path: path.name)
def test_every_diagram_of_the_repository_is_right_with_every_variant(path: Path) -> None:
    check(path)


OWN = '''\
"""A block of the test."""

from quadvis.block import Block, In, Out, Param


class Own(Block):
    """Two parameters and an input of one size."""

    first = Param((1.0, 2.0), type="float64[n]")
    second = Param((1.0, 2.0), type="float64[n]", unit="a")
    u = In("float64[n]", unit="a")
    y = Out("float64[n]", unit="a")

    def output(self, u):
        """Return the sum."""
        return self.first * (self.second + u)
'''


def test_parameters_and_wires_agree_on_the_size_of_a_block(tmp_path: Path) -> None:
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    (tmp_path / "blocks" / "own" / "own.py").write_text(OWN)
    right = "  a: {block: own.own, rate: fast, with: {second: [3 m, 4 s]}, in: {u: [1 m, 2 s]}}\n"
    loaded = load_text(diagram(right), tmp_path)
    assert loaded.graph["a"].sizes == {"n": 2}
    assert loaded.graph["a"].unit("y") == "m s"
    assert load_text(loaded.resolved, tmp_path).hash == loaded.hash
    assert refused(diagram(right.replace("[3 m, 4 s]", "[3 m, 4 s, 5 m]")), tmp_path) == [
        "second has 3 values, the other parameters make it 2 values"
    ]
    assert refused(diagram(right.replace("[1 m, 2 s]", "[1 m]")), tmp_path) == [
        "input 'u' takes 2 values, the constant has a list of one value"
    ]
    assert refused(diagram(right.replace("[1 m, 2 s]", "[1 m, 2 kg]")), tmp_path) == [
        "'u' has kg, its unit here is s"
    ]


# What nobody writes by accident.


def refused(text: str, folder: Path) -> list[str]:
    with pytest.raises(DiagramError) as caught:
        load_text(text, folder)
    return told(caught.value)


def diagram(blocks: str) -> str:
    return f"quadvis: 1\nname: case\nrates: {{fast: 10 Hz}}\nstop_time: 1 s\nblocks:\n{blocks}"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (diagram("  a: " + "[" * 100_000), "this is nested deeper than 50 levels"),
        (diagram("  a: " + "{a: " * 100_000), "this is nested deeper than 50 levels"),
        ("- " * 100_000, "this is nested deeper than 50 levels"),
        ("a: &a [x]\n" + "\n".join(f"b{i}: [*a, *a]" for i in range(9)), "the anchor '&a' is not allowed"),
        ("<<: {quadvis: 1}\n", "the merge key '<<' is not allowed"),
        (diagram("  a: !!python/name:os.system [ls]\n"), "the tag '!!python/name:os.system' is not allowed"),
        ("quadvis: 1\x00", "the control character U+0000 is not allowed"),
        ("quadvis: 1\n\u202ename: x", "the control character U+202E is not allowed"),
        ("", "the file is empty"),
        ("# nothing\n", "the file is empty"),
        ("- quadvis\n", "this must be a map, not a list"),
        ("quadvis", "this must be a map, not 'quadvis'"),
        ("quadvis: 1\n---\nquadvis: 1\n", "a second document begins here"),
        ("%YAML 1.1\n---\nquadvis: 1\n", "a line that begins with '%' is not allowed"),
        ("quadvis: 1\n\tname: x\n", "a tab cannot indent a line"),
        ("a: " + "x" * MAX_BYTES, "the text is larger than 16 MB"),
        ("a: [" + "1," * 100_001 + "]", "the file holds more than 100000 values"),
    ],
    ids=range(17),
)  # fmt: skip
def test_hostile_yaml_is_refused(text: str, problem: str, tmp_path: Path) -> None:
    assert problem in refused(text, tmp_path)


def test_an_element_of_a_signal_without_quotes_is_told_how_to_write_it(tmp_path: Path) -> None:
    text = diagram('  a: {block: signal.gain, rate: fast, in: {u: "b.y[1]", v: b.y[0:2]}}\n')
    with pytest.raises(DiagramError) as caught:
        load_text(text, tmp_path)
    fault = caught.value.faults[1]
    others = [other.problem for other in caught.value.faults if other != fault]  # the reading goes on
    assert others == ["there is no block 'b'", "signal.gain has no input 'v'", "there is no block 'b'"]
    assert (fault.place.line, fault.place.column) == (6, text.splitlines()[5].index("b.y[0") + 1)
    assert (fault.problem, fault.remedy) == ("a text with '[' needs quotes here", 'write "b.y[0:2]"')


@pytest.mark.parametrize("number", ["1" * 400, "1e999999999", "-1e400", "1" * 5000, "1/" + "9" * 300])
def test_huge_numbers_are_refused(number: str, tmp_path: Path) -> None:
    source = f"  a: {{block: sources.constant, rate: fast, with: {{value: {number}}}}}\n"
    for text in (
        diagram(source),
        diagram(source).replace("10 Hz", f"{number} Hz"),
        diagram(source).replace("1 s", f"{number} s"),
        diagram(source).replace("quadvis: 1", f"quadvis: {number}"),
        diagram(source).replace("name", f"seed: {number}\nname"),
    ):
        assert refused(text, tmp_path)


@pytest.mark.parametrize("name", ["x" * 5000, "../" * 2000, "/dev/zero", "/dev/stdin", ".", "a\\b"])
def test_a_part_that_cannot_be_opened_is_refused(name: str, tmp_path: Path) -> None:
    problem = refused(diagram(f"  a: {{part: '{name}', rate: fast}}\n"), tmp_path)
    assert problem == [f"there is no file '{name}'"] or problem[0].startswith("this is not")


@pytest.mark.parametrize(
    "name", ["x" * 5000, "a." * 200 + "b", "os.system", "sources.sine.sine", "é.e", "a:b:c", "a..b"]
)
def test_a_block_that_cannot_be_is_refused(name: str, tmp_path: Path) -> None:
    assert len(refused(diagram(f"  a: {{block: '{name}', rate: fast}}\n"), tmp_path)) == 1


def test_files_that_are_no_diagrams_are_refused(tmp_path: Path) -> None:
    (tmp_path / "latin.yaml").write_bytes(b"name: caf\xe9\n")
    (tmp_path / "binary.yaml").write_bytes(bytes(range(256)))
    (tmp_path / "huge.yaml").write_bytes(b"#" * 2_000_000)
    os.mkfifo(tmp_path / "pipe.yaml")
    for name in (
        "latin.yaml",
        "binary.yaml",
        "huge.yaml",
        "pipe.yaml",
        "none.yaml",
        ".",
        "x" * 300,
        "none/x.yaml",
    ):
        with pytest.raises(DiagramError) as caught:
            load(tmp_path / name)
        assert len(caught.value.faults) == 1


def test_parts_that_multiply_are_refused(tmp_path: Path) -> None:
    head = "quadvis: 1\nname: part\nports: {}\nblocks:\n"
    for level in range(20):
        twice = f"{{part: {level + 1}.yaml, rate: fast}}"
        (tmp_path / f"{level}.yaml").write_text(f"{head}  a: {twice}\n  b: {twice}\n")
    (tmp_path / "20.yaml").write_text(f"{head}  a: {{block: sources.sine}}\n")
    assert "there are more than 50000 blocks in parts" in refused(
        diagram("  a: {part: 0.yaml, rate: fast}\n"), tmp_path
    )


def test_parts_in_parts_without_end_are_refused(tmp_path: Path) -> None:
    for level in range(100):
        (tmp_path / f"{level}.yaml").write_text(
            f"quadvis: 1\nname: part\nports: {{}}\nblocks:\n  a: {{part: {level + 1}.yaml}}\n"
        )
    assert refused(diagram("  a: {part: 0.yaml, rate: fast}\n"), tmp_path) == [
        "parts are nested deeper than 30 files"
    ]


def test_a_signal_through_very_many_parts_is_refused(tmp_path: Path) -> None:
    (tmp_path / "through.yaml").write_text(
        "quadvis: 1\nname: through\nports: {in: [u], out: {y: in.u}}\nblocks: {a: {block: sources.sine}}\n"
    )
    parts = [f"  p{i}: {{part: through.yaml, rate: fast, in: {{u: p{i + 1}.y}}}}\n" for i in range(2000)]
    source = "  p2000: {block: sources.sine, rate: fast}\n"
    problems = refused(diagram("".join(parts) + source), tmp_path)
    assert all("leads through more than 50 ports" in problem for problem in problems)


def test_a_long_chain_written_backwards_is_checked_in_linear_time(tmp_path: Path) -> None:
    def calls(count: int) -> int:
        gains = [f"  g{i}: {{block: signal.gain, rate: fast, in: {{u: g{i + 1}.y}}}}\n" for i in range(count)]
        text = diagram("".join(gains) + f"  g{count}: {{block: sources.sine, rate: fast}}\n")
        profile = cProfile.Profile()
        profile.runcall(load_text, text, tmp_path)
        return pstats.Stats(profile).total_calls  # type: ignore[attr-defined]

    calls(10)
    assert calls(800) < 1.2 * 8 * calls(100)


# Everything else.

TOKENS = re.compile(r"[\w./$]+|[^\w\s]")
STRANGE = (
    "", "{}", "[]", "[[1], [2, 3]]", "$x", "$target", "$target[1]", "in.position", "true", "null", "1e999",
    "-1", "0", "1 m", "2 rad/s", "[", "}", "&a", "*a", "!x", "'", '"', "a.b", "craft.position[0]",
    "craft.position[9]", "craft.position[:,1]", "continuous", "{value: 1, unit: m}",
    "{from: craft.position}", "parts/estimate.yaml", "{from: craft.position, across: delay}", "hover.yaml",
    "..", "~", "\x00", "ä", "\U0001f642", "x" * 300, "1_000", "a/b.c", "eyes/camera.frame", "rates",
    "blocks", "signal", "plant.rotorcraft", "signal.unit_delay", "1e-320 s", "1/0 s", "1/3 s", "m m m",
    "a/s", "[1 m, 2, 3 rad]", ": ", "- ", "#", "\n", "? ", "|", ">",
)  # fmt: skip


@st.composite
def mutated(draw: st.DrawFn) -> str:
    """Return the text of the hover with lines and tokens deleted, doubled, moved or replaced."""
    text = HOVER
    for _ in range(draw(st.integers(1, 6))):
        lines = text.split("\n")
        at, other = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        action = draw(st.sampled_from(["delete", "double", "swap", "indent", "drop", "copy", "strange"]))
        if action == "delete":
            del lines[at]
        elif action == "double":
            lines.insert(other, lines[at])
        elif action == "swap":
            lines[at], lines[other] = lines[other], lines[at]
        elif action == "indent":
            lines[at] = " " * draw(st.integers(0, 6)) + lines[at].strip()
        text = "\n".join(lines)
        tokens = [match.span() for match in TOKENS.finditer(text)]
        if action in ("drop", "copy", "strange") and tokens:
            start, end = draw(st.sampled_from(tokens))
            first, last = draw(st.sampled_from(tokens))
            new = {"drop": "", "copy": text[first:last]}.get(action) or draw(st.sampled_from(STRANGE))
            text = text[:start] + new + text[end:]
    return text


@pytest.mark.faults
@given(mutated())
def test_whatever_is_done_to_a_diagram_it_loads_or_has_faults(text: str) -> None:
    try:
        loaded = load_text(text, DIAGRAMS)
    except DiagramError as error:
        assert 0 < len(error.faults) <= Faults.LIMIT
        assert all("\n" not in str(fault) for fault in error.faults)
        assert len(set(error.faults)) == len(error.faults)
    else:
        assert load_text(loaded.resolved, DIAGRAMS).hash == loaded.hash


@given(st.text(max_size=200) | st.text(alphabet="quadvis:1{}[]&*!'\"\n -#,ab.$", max_size=200))
def test_whatever_is_in_a_file_it_has_faults(text: str) -> None:
    with pytest.raises(DiagramError):
        load_text(text)


def test_loading_a_diagram_imports_nothing_heavy() -> None:
    import subprocess

    code = (
        "import sys, quadvis; quadvis.load('hover.yaml');"
        "print(sorted({'cv2', 'control', 'scipy', 'matplotlib', 'numba', 'mcap'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=DIAGRAMS, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("solver", ["{step: 10 ms}", "{step: 10 ms, method: ode4}"])
def test_a_solver_without_a_method_is_ode4(tmp_path: Path, solver: str) -> None:
    path = tmp_path / "decay.yaml"
    path.write_text(
        f"{{quadvis: 1, name: decay, solver: {solver}, stop_time: 1 s, blocks: {{"
        "x: {block: signal.integrator, with: {initial: 1}, in: {u: u.y}},"
        "u: {block: signal.gain, rate: continuous, with: {factor: -1 1/s}, in: {u: x.y}}}}"
    )
    assert quadvis.load(path).run(log=None)["x.y"][-1] == pytest.approx(math.exp(-1), rel=1e-9)
