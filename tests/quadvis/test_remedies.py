"""Remedies are right: they suggest what was meant, and never blame a correct part."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

import quadvis
from quadvis.api import check, load, load_text
from quadvis.document import read_yaml
from quadvis.errors import DiagramError, Fault, QuadvisError, closest, suggestion
from quadvis.errors.caller import command_words
from quadvis.library.catalogue import Catalogue
from quadvis.machine.missing_file import file_trouble

NAMES = Catalogue().names()
HEAD = "quadvis: 1\nname: n\nrates: {fast: 100 Hz, slow: 10 Hz}\nstop_time: 1 s\n"
DIAGRAM = HEAD + (
    "params: {size: 1 m}\n"
    "blocks:\n"
    "  source: {block: sources.step, rate: fast, with: {after: $size}}\n"
    "  lag: {block: signal.low_pass, rate: fast, with: {time_constant: 1 s}, in: {u: source.y}}\n"
    "expect:\n"
    "  - {signal: lag.y, below: 1 m, after: 0 s}\n"
)


def faults(text: str, folder: Path) -> list[Fault]:
    with pytest.raises(DiagramError) as caught:
        load_text(text, folder)
    return caught.value.faults


SYNONYMS = [
    ("block: sources.step", "type: sources.step", "block"),
    ("rate: fast, with: {a", "freq: fast, with: {a", "rate"),
    ("rate: fast, with: {t", "sample_time: fast, with: {t", "rate"),
    ("rate: fast, with: {t", "Ts: fast, with: {t", "rate"),
    ("with: {t", "params: {t", "with"), ("with: {t", "parameters: {t", "with"),
    ("in: {u", "inputs: {u", "in"),
    ("in: {u", "connections: {u", "in"), ("params:", "parameters:", "params"),
    ("stop_time:", "duration:", "stop_time"),
    ("below:", "max:", "below"), ("below:", "tolerance:", "within"), (", after:", ", start:", "after"),
    ("expect:", "assertions:", "expect"), ("rates:", "sample-times:", "rates"),
    ("blocks:", "components:", "blocks"),
    ("name: n", "title: n", "name"), ("quadvis:", "version:", "quadvis"),
]  # fmt: skip


@pytest.mark.parametrize(("ours", "theirs", "key"), SYNONYMS)
def test_a_word_of_another_program_is_one_fault(ours: str, theirs: str, key: str, tmp_path: Path) -> None:
    assert ours in DIAGRAM
    (fault,) = faults(DIAGRAM.replace(ours, theirs, 1), tmp_path)
    assert fault.remedy == f"did you mean '{key}'?"
    unknown = theirs.partition(":")[0].strip(", ")
    assert fault.problem == f"key '{unknown}' is unknown"


def test_words_of_other_programs_are_taken_only_where_nothing_is_near() -> None:
    assert closest("max", ["below", "mix"]) == "mix"
    assert closest("max", ["lower"]) is None
    assert closest("Mux", ["signal.concatenate", "signal.sum"]) == "signal.concatenate"
    assert suggestion("inputs", ["in", "out"]) == "did you mean 'in'?"


GIVEN = [
    ("lower: 1, lowr: 2", "'lower', which is given already?"),
    ("uppr: 2, upper: 1", "'upper', which is given already?"),
    ("lowr: 1", "'lower'?"), ("lower: 1, uppr: 2", "'upper'?"),
]  # fmt: skip


@pytest.mark.parametrize(("values", "meant"), GIVEN)
def test_a_name_given_twice_is_said_to_be(values: str, meant: str, tmp_path: Path) -> None:
    text = f"{HEAD}blocks:\n  z: {{block: signal.saturation, rate: fast, with: {{{values}}}, in: {{u: 0}}}}\n"
    (fault,) = faults(text, tmp_path)
    assert fault.remedy == f"did you mean {meant}"


def test_a_setting_may_name_what_is_given_already(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    path.write_text(DIAGRAM)
    for name, meant in (("lag.time_constnt", "time_constant"), ("source.aftr", "after"), ("sise", "size")):
        with pytest.raises(DiagramError) as caught:
            load(path, settings=[f"{name}=1"])
        assert str(caught.value).endswith(f"did you mean '{meant}'?")


SETTINGS = {
    "lag.time_constant": ["1", "1 m", "[1 s", "1,5 s", "[[1, 2]] N", "\u22121 s", "-1 s", "", "{value: 1}",
    "$size"],
    "size": ["1", "@", "2 furlong", "\u22122 m", "1e999 m"], "source.after": ["2 x", "1_0 m"],
    "lag.time": ["1 s"], "nobody.x": ["1"], "": ["1"], "lag.": ["1"], "si\u00adze": ["1 m"],
}  # fmt: skip


@pytest.mark.parametrize("name", SETTINGS)
def test_a_wrong_setting_is_one_fault_that_names_where_it_was_given(name: str, tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    path.write_text(DIAGRAM.replace("with: {after: $size}", "with: {after: $size, before: $size}"))
    for value in SETTINGS[name]:
        texts, mapping = [f"{name}={value}"], {name: value}
        for words, settings in ((command_words, texts), (nullcontext, texts), (nullcontext, mapping)):
            origin = "--set" if words is command_words else "settings"
            for function in (load, check):
                try:
                    with words():
                        function(path, settings=settings)
                except DiagramError as error:
                    (fault,) = error.faults
                    assert str(fault).startswith(f"{origin}: ") and (
                        origin == "--set" or "--" not in str(fault)
                    )
                else:
                    assert name == "size" and value in ("1", "[1 m, 2 m]")


CALLS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "stop_time": (lambda path: load(path, stop_time="5"), "stop_time: '5' has no unit"),
    "seed": (lambda path: load(path, seed=2**64), "seed: the seed '18446744073709551616' does not fit"),
    "settings": (lambda path: quadvis.sweep(path, ["seed=1"], settings={"sise": "1 m"}), "settings: "),
    "over": (lambda path: quadvis.sweep(path, {"lag.time_constant": ["1 s", "2"]}), "over lag.time_"),
    "nothing": (lambda path: quadvis.sweep(path, {}), "give an axis, such as {'seed': range(30)}"),
    "cuts": (lambda path: load(path).analyse(cuts={"a": "lagg.y"}), "cuts: there is no block 'lagg'"),
    "limits": (lambda path: load(path).analyse(limits={"a": ("sise", "1 m", "2 m")}), "limits: "),
    "own_blocks": (lambda path: load(path.with_name("own.yaml"), own_blocks=False), "out own_blocks=False"),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_python_is_answered_in_its_own_words(name: str, tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    path.write_text(DIAGRAM)
    (tmp_path / "own.yaml").write_text(DIAGRAM.replace("signal.low_pass", "mine.lag"))
    (tmp_path / "blocks" / "mine").mkdir(parents=True)
    (tmp_path / "blocks" / "mine" / "lag.py").touch()
    call, words = CALLS[name]
    with pytest.raises(QuadvisError) as caught:
        call(path)
    assert words in str(caught.value) and "--" not in str(caught.value)


def test_several_settings_are_told_apart_by_their_number(tmp_path: Path) -> None:
    path = tmp_path / "d.yaml"
    path.write_text(DIAGRAM)
    with pytest.raises(DiagramError) as caught:
        load(path, settings=["lag.time_constant=1", "size=2 m", "lag.time=1 s"])
    assert [fault.place.column for fault in caught.value.faults] == [1, 3]


def test_a_range_of_a_parameter_is_not_blamed_for_its_value(tmp_path: Path) -> None:
    text = DIAGRAM.replace("{size: 1 m}", "{size: 1 m, lag: 1 s}").replace(
        "time_constant: 1 s", "time_constant: $lag"
    )
    path = tmp_path / "d.yaml"
    path.write_text(text + "analyse:\n  limits:\n    lag: {vary: lag, from: 1 s, to: 2 s}\n")
    load(path)
    with pytest.raises(DiagramError) as caught:
        load(path, settings=["lag=1"])
    assert str(caught.value) == "settings: 'lag': '1' has no unit; did you mean '1 s'?"


@pytest.mark.parametrize("step", ["3 ms", "7 ms", "1/3 s", "0.3 ms", "11 ms"])
def test_a_step_that_does_not_divide_makes_no_wire_the_newest(step: str, tmp_path: Path) -> None:
    text = DIAGRAM.replace("blocks:\n", "blocks:\n  i: {block: signal.integrator, in: {u: source.y}}\n"
                           "  g: {block: signal.gain, rate: fast, in: {u: i.y}}\n")  # fmt: skip
    found = faults(text + f"solver: {{step: {step}}}\n", tmp_path)
    assert [fault.remedy for fault in found][:2] == ["add 'across: hold'", "add 'across: sample'"]
    wires = text.replace("u: source.y}}\n  g", "u: {from: source.y, across: hold}}}\n  g")
    wires = wires.replace("u: i.y", "u: {from: i.y, across: sample}")
    (fault,) = faults(wires + f"solver: {{step: {step}}}\n", tmp_path)
    assert "not commensurate" in fault.problem


MISSING = [
    ("lef.yaml", "did you mean 'leaf.yaml'?"), ("LEAF.yaml", "did you mean 'leaf.yaml'?"),
    ("leaf.yml", "did you mean 'leaf.yaml'?"), ("nofile.yaml", "path is relative"),
    ("x.yaml", "path is relative"),
    ("E1.yaml", "path is relative"),
    ("sub\\leaf.yaml", "write '/' between folders: 'sub/leaf.yaml', which is there"),
    ("sub\\other.yaml", "write '/' between folders: 'sub/other.yaml'"),
    (".\\leaf.yaml", "'./leaf.yaml', which is there"),
    ("..\\sub\\leaf.yaml", "write '/' between folders: '../sub/leaf.yaml'"),
    ("sub\new.yaml", "write '/' between folders"),
    ("leaf.yaml/x", "path is relative"), ("x" * 5000, "path is relative"), ("sub", "path is relative"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "remedy"), MISSING, ids=range(len(MISSING)))
def test_a_missing_file_suggests_only_what_is_near(name: str, remedy: str, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    for file in ("leaf.yaml", "bad1.yaml", "sub/leaf.yaml"):
        (tmp_path / file).write_text("")
    problem, said = file_trouble(f"{tmp_path}/{name}", name)
    assert problem == f"there is no file '{name}'"
    assert remedy in said and ("did you mean" in remedy) == ("did you mean" in said)
    assert ("which is there" in remedy) == ("which is there" in said)


def test_pipes_and_devices_are_refused_at_once_wherever_a_file_belongs(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    for name in (tmp_path / "pipe.yaml", "/dev/zero", "/dev/null"):
        with pytest.raises(DiagramError, match="this is not a file but a pipe or a device; name a YAML file"):
            read_yaml(name)
        text = f"{HEAD}blocks:\n  a: {{part: '{name}', rate: fast}}\n"
        assert [fault.problem for fault in faults(text, tmp_path)] == [
            "this is not a file but a pipe or a device"
        ]
    (tmp_path / "d.yaml").write_text(DIAGRAM)
    with pytest.raises(DiagramError, match="not a file but a pipe"):
        load(tmp_path / "d.yaml", params=tmp_path / "pipe.yaml")


SECRETS = [
    "password: hunter2 sesame\n", "hunter2 sesame\n", "- hunter2\n- sesame\n",
    "a: {hunter2: sesame}\nb: [c}\n",
    "hunter2: 'sesame\n", "quadvis: hunter2\nsesame: 1\n", "hunter2\nsesame: x: y\n",
    "a: @hunter2\nb: sesame: c\n",
    "a: &hunter2 b\nc: *sesame\n", "!hunter2 sesame\n", "hunter2:sesame\n", "{hunter2:sesame}\n",
    "size: [hunter2, sesame]\nmatrix: hunter2\n", "hunter2: 1\nhunter2: sesame\n", "a: [1] hunter2\n",
    "a: hunter2[0\n",
]  # fmt: skip


@pytest.mark.parametrize("secret", SECRETS, ids=range(len(SECRETS)))
def test_nothing_of_a_file_elsewhere_is_quoted(secret: str, tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "secret.yaml").write_text(secret)
    (home / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    square = "{value: [[0, 0], [1, 0], [1, 1], [0, 1]], unit: px}"
    for name in ("../secret.yaml", "link.yaml", str(tmp_path / "secret.yaml")):
        entries = f"  a: {{part: '{name}', rate: fast}}\n"
        given = f"with: {{calibration: '{name}'}}, in: {{centres: {square}}}"
        entries += f"  b: {{block: vision.pose_plane, rate: fast, {given}}}\n"
        (home / "d.yaml").write_text(f"{HEAD}blocks:\n{entries}")
        with pytest.raises(DiagramError) as caught:
            load(home / "d.yaml")
        assert "hunter2" not in str(caught.value) and "sesame" not in str(caught.value)
        assert any(
            "secret.yaml:" in str(fault) or "link.yaml:" in str(fault) for fault in caught.value.faults
        )


def test_files_of_the_diagrams_own_folder_and_files_that_the_user_named_are_quoted(tmp_path: Path) -> None:
    (tmp_path / "home/parts").mkdir(parents=True)
    (tmp_path / "home/parts/leaf.yaml").write_text("hunter2: 1\n")
    (tmp_path / "set.yaml").write_text("quadvis: 1\nname: s\nset: {}\nsesame: 1\n")
    path = tmp_path / "home/d.yaml"
    path.write_text(f"{HEAD}blocks:\n  a: {{part: parts/leaf.yaml, rate: fast}}\n")
    with pytest.raises(DiagramError) as caught:
        load(path, params=tmp_path / "set.yaml")
    assert "hunter2" in str(caught.value) and "sesame" in str(caught.value)


@pytest.mark.parametrize(
    ("word", "block"),
    [
        ("Mux", "signal.concatenate"), ("Selector", "signal.select"), ("Add", "signal.sum"),
        ("Product", "math.product"), ("Divide", "math.product"), ("DotProduct", "math.dot"),
        ("Abs", "math.function"), ("Sqrt", "math.function"), ("cos", "math.function"),
        ("MinMax", "math.min_max"), ("DataTypeConversion", "math.convert"), ("Switch", "logic.switch"),
        ("MultiportSwitch", "logic.multiport_switch"), ("RelationalOperator", "logic.compare"),
        ("CompareToConstant", "logic.compare"), ("LogicalOperator", "logic.gate"),
        ("DeadZone", "signal.dead_zone"), ("Relay", "signal.relay"), ("Quantizer", "signal.quantizer"),
        ("Lookup", "signal.lookup_1d"), ("1-D Lookup Table", "signal.lookup_1d"), ("Delay", "signal.delay"),
        ("RateLimiter", "signal.rate_limiter"), ("Saturation", "signal.saturation"),
        ("DiscreteTimeIntegrator", "signal.discrete_integrator"),
        ("TIME", "sources.clock"), ("Chirp Signal", "sources.chirp"), ("Clock", "sources.clock"),
        ("UniformRandomNumber", "sources.uniform_noise"), ("RepeatingSequence", "sources.repeating_sequence"),
        ("SRFlipFlop", "logic.latch"), ("signal.stack", "signal.concatenate"),
        ("signal.abs", "math.function"), ("signal.mux", "signal.concatenate"),
        ("Sign", "math.function"), ("Demux", "signal.select"),
        ("TransferFcn", "systems.transfer_function"), ("LTI_SISO", "systems.transfer_function"),
        ("Discrete Transfer Fcn", "systems.transfer_function"), ("StateSpace", "systems.state_space"),
        ("LTI_SS", "systems.state_space"), ("Zero-Pole", "systems.zero_pole_gain"),
        ("zpk", "systems.zero_pole_gain"),
        ("PID", "systems.pid"), ("signal.pid", "systems.pid"), ("PID Controller", "systems.pid"),
        ("DiscreteFIRFilter", "systems.fir"), ("butter", "systems.butterworth"), ("sos", "systems.biquad"),
        ("MovingAverage", "systems.moving_average"), ("KalmanFilter", "systems.kalman"),
        ("Luenberger", "systems.kalman"), ("LQR", "systems.lqr"), ("RMS", "systems.statistics"),
        ("Spectrum Analyzer", "systems.spectrum"), ("FFT", "systems.spectrum"),
        ("6DOF", "plant.rigid_body"), ("Quaternion Rotation", "rotation.rotate"),
        ("Quaternion Normalize", "rotation.normalise"), ("rpy2tr", "rotation.representation"),
        ("Direction Cosine Matrix to Quaternions", "rotation.representation"),
        ("Quaternion Multiplication", "rotation.quaternion_product"),
    ],
)  # fmt: skip
def test_blocks_are_found_by_the_names_of_simulink_and_bdsim(word: str, block: str) -> None:
    assert closest(word, NAMES) == block
