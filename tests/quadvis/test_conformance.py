"""The suite lets good blocks pass, and each check catches the fault that it is there for."""

import sys
from pathlib import Path

import pytest

from quadvis.block import Block
from quadvis.library.catalogue import Catalogue
from quadvis.testing.conformance import CHECKS, Subject, check_block, excuse

GOOD = '''"""A fan."""

from quadvis.block import Block, Frame, In, Out, Param, ParameterError, Random, State, uniform

class Fan(Block):
    """A fan that spins up towards its command."""

    command = In("float64[*]", unit="rad/s", doc="speed wanted")
    enable = In("bool", default=True, doc="whether it may turn")
    speed = Out("float64[*]", unit="rad/s", doc="speed")
    turns = Out("int64", doc="how many")
    lag = Param(0.5, unit="s", above=0.0, max=10.0, doc="time constant")
    blades = Param(3, type="int64", min=1, doc="number of blades")
    offset = Param((0.0, 1.0), type="float64[2]", min=-5.0, doc="offsets")
    model = Param("slow", choices=("slow", "fast"), doc="how it follows")
    now = State("float64[*]")
    count = State("int64")
    stream = Random()

    def start(self):
        self.now = uniform(self.stream)

    def output(self, enable):
        if not enable:
            return 0.0 * self.now, self.count
        return self.now + self.offset[0], self.count

    def update(self, command):
        share = self.period / self.lag if self.model == 0 else 1.0
        self.now = self.now + share * (command - self.now)
        self.count += self.blades
'''


def block(folder: Path, text: str = GOOD) -> type[Block]:
    """Return the block of a file fan.py: on disk, since compiled code is made from the source."""
    file = folder / "blocks" / "wind" / "fan.py"
    file.parent.mkdir(parents=True)
    file.write_text(text)
    return Catalogue(folder).find("wind.fan")


def test_a_good_block_passes(tmp_path: Path) -> None:
    pytest.importorskip("numba")
    check_block(block(tmp_path), test=tmp_path / "blocks" / "wind" / "fan.py")


def test_a_missing_test_is_told(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match=r"there is no test at .*test_fan\.py; write one"):
        CHECKS["tested"](Subject(block(tmp_path), test=tmp_path / "test_fan.py"))


def test_a_file_is_called_as_its_class(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match=r"the class in fan\.py must be called Fan"):
        CHECKS["one_block_in_its_module"](Subject(block(tmp_path, GOOD.replace("class Fan", "class Blower"))))


def test_a_module_has_one_public_block(tmp_path: Path) -> None:
    found = block(tmp_path)
    other = type("Other", (Block,), {"__module__": found.__module__})
    sys.modules[found.__module__].__dict__["Other"] = other
    with pytest.raises(AssertionError, match="the module defines Fan, Other; move the others"):
        CHECKS["one_block_in_its_module"](Subject(found))


WORKING = (
    GOOD.replace("State, uniform\n", "State, Work, uniform\n")
    .replace(
        "    stream = Random()",
        '    stream = Random()\n    gain = Work("float64[*]")\n    told = Work("bool")',
    )
    .replace(
        "        if not enable:",
        "        self.gain = 2.0 * self.now\n        self.told = enable\n        if not enable:",
    )
    .replace("share * (command - self.now)", "share * (command - 0.5 * self.gain * self.told)")
)


@pytest.mark.slow
def test_a_block_whose_update_uses_what_output_has_computed_passes(tmp_path: Path) -> None:
    check_block(block(tmp_path, WORKING), test=tmp_path / "blocks" / "wind" / "fan.py")


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("        self.told = enable\n", ""),
        ("        self.told = enable", "        self.told = enable or self.told"),
        ("        self.gain = 2.0 * self.now\n        self.told = enable\n        if not enable:\n",
         "        if not enable:\n"),
    ],
)  # fmt: skip
def test_work_that_outlasts_its_tick_is_reported(before: str, after: str, tmp_path: Path) -> None:
    assert WORKING.count(before) == 1
    with pytest.raises(
        AssertionError, match="Work was read before output wrote it; keep in states what lasts"
    ):
        CHECKS["work_is_of_one_tick"](Subject(block(tmp_path, WORKING.replace(before, after))))


def test_a_derivative_that_reads_work_is_reported(tmp_path: Path) -> None:
    text = WORKING.replace(
        'count = State("int64")', 'count = State("int64")\n    angle = State(continuous=True)'
    )
    text += "\n    def deriv(self):\n        return self.told + 0.0 * self.angle\n"
    with pytest.raises(AssertionError, match="deriv reads Work at step 0; only update may"):
        CHECKS["work_is_of_one_tick"](Subject(block(tmp_path, text)))


DEVICE = '''"""A fan that is there."""

from quadvis.block import Block, In, Out, Safe, State, Work

class Fan(Block, numeric=False):
    """A fan on a wire."""

    not_replayable = "it reads the speed of a fan"
    wires = []
    command = In("float64[2]", unit="rad/s", doc="speed wanted")
    rest = Safe("command", doc="speed when the run ends")
    speed = Out(unit="rad/s", doc="speed")
    turns = State("float64")
    now = Work(unit="rad/s")

    def open(self):
        self.rounds = 0

    def read(self, time):
        self.rounds += 1
        self.now = time + self.rounds

    def output(self):
        return self.now

    def write(self, command, time):
        self.wires.append((list(command), time))

    def update(self):
        self.turns += self.period * self.now
'''


def test_a_block_that_reads_and_writes_outside_is_excused_from_repeating_itself(tmp_path: Path) -> None:
    found = block(tmp_path, DEVICE)
    check_block(found, given={"rest": [0.25, 0.5]}, test=tmp_path / "blocks" / "wind" / "fan.py")
    (*_, last) = found.wires  # type: ignore[attr-defined]
    assert last[0] == [0.25, 0.5]
    assert excuse("repeats_after_restore", found) == "it reads the speed of a fan"
    assert excuse("returns_what_it_declares", found) == ""


def test_without_the_tag_it_must_repeat_itself(tmp_path: Path) -> None:
    found = block(tmp_path, DEVICE.replace("not_replayable =", "reason ="))
    with pytest.raises(AssertionError, match="repeats_after_restore: restored in the same engine"):
        check_block(found, given={"rest": [0.25, 0.5]})


@pytest.mark.parametrize(
    ("before", "after", "sentence"),
    [
        ("self.rounds += 1", "self.rounds += 1\n        self.turns = 1.0", "read changed a state at step 0"),
        ("self.wires.append(", "self.turns += 1.0\n        self.wires.append(", "write changed a state"),
        ("self.wires.append(", "return self.wires.append(1) or (", "write must return nothing"),
    ],
)  # fmt: skip
def test_what_reads_and_writes_outside_may_not_touch_states(
    before: str, after: str, sentence: str, tmp_path: Path
) -> None:
    text = DEVICE.replace(before, after)
    with pytest.raises(AssertionError, match=sentence):
        CHECKS["outside_changes_nothing"](Subject(block(tmp_path, text), {"rest": [0.0, 0.0]}))


COUNT = "        self.count += self.blades"
BLIND = """    def __init__(self, **given):
        self.__dict__.update(lag=0.5, blades=3, offset=(0.0, 1.0), model=0)

    def start"""
WRONG_WORDS = """    def __init__(self, **given):
        try:
            super().__init__(**given)
        except ParameterError as error:
            raise ParameterError(error.parameter, "wrong" if error.parameter == "blades" else str(error))

    def start"""
REMEMBERS = """        self.runs = getattr(self, "runs", 0) + 1
        self.now = float(self.runs) + uniform(self.stream)"""
CALLS = """        self.calls = getattr(self, "calls", 0) + 1
        if not enable or self.calls % 2:"""
HIDES = """        self.hidden = getattr(self, "hidden", 0) + 1
        self.count += self.hidden * self.blades"""
OPENS = """        if not hasattr(self, "first"):
            self.first = self.count
        self.count += self.blades + self.first"""
FAULTS = [
    (
        "documented",
        "towards its command.",
        "towards its command",
        "must be a sentence that ends in a full stop",
    ),
    ("documented", ', doc="speed wanted"', "", "these need a doc: command"),
    ("all_declarations_used", COUNT, f"{COUNT}\n\n    idle = State()", "no method uses idle"),
    ("all_declarations_used", COUNT, f"{COUNT}\n\n    idle = In(default=0.0)", "no method asks for idle"),
    ("refuses_bad_parameters", "    def start", BLIND, "lag = 'no such choice' must be refused"),
    ("refuses_bad_parameters", "    def start", WRONG_WORDS, "say 'blades must be ...', not 'wrong'"),
    (
        "refuses_before_a_run",
        "        self.now = uniform(self.stream)",
        "        self.now = uniform(self.stream)\n        1 / (self.blades < 9)",
        "refuse it in check",
    ),
    ("starts_the_same", "        self.now = uniform(self.stream)", REMEMBERS, "keep nothing in attributes"),
    (
        "output_changes_nothing",
        "        if not enable:",
        "        self.count += 1\n        if not enable:",
        "only update may",
    ),
    ("output_changes_nothing", "        if not enable:", CALLS, "output gave two answers at step 0"),
    ("repeats_after_restore", COUNT, HIDES, "restored in the same engine the run differs"),
    ("repeats_after_restore", COUNT, OPENS, "restored in a fresh engine the run differs"),
    (
        "returns_what_it_declares",
        "[0], self.count",
        "[0], 0.5 * self.count",
        "must return int64 for turns, it returned 0.0",
    ),
    (
        "returns_what_it_declares",
        "return self.now + self.offset[0], self.count",
        "return self.count",
        "must return 2 values",
    ),
]


STAMPED = (
    GOOD.replace("    model = Param", '    stamp = In(unit="s", doc="when it was wanted")\n    model = Param')
    .replace("    stream = Random()", '    stream = Random()\n    newest = State(unit="s")')
    .replace("def update(self, command):", "def update(self, command, stamp, time):\n        NEWS")
)
RULE = """if not self.newest < stamp <= time:
            return
        self.newest = stamp"""
TRUSTING = """if not self.newest < stamp:
            return
        self.newest = stamp"""
CHANGED = """if stamp == self.newest or stamp != stamp:
            return
        self.newest = stamp"""
NOW = """made = min(stamp, time)
        if not self.newest < made:
            return
        self.newest = made"""


def test_a_block_that_knows_which_stamp_is_news_outlives_hostile_ones(tmp_path: Path) -> None:
    CHECKS["outlives_hostile_stamps"](Subject(block(tmp_path, STAMPED.replace("NEWS", RULE))))


@pytest.mark.parametrize(
    ("rule", "sentence"),
    [
        (TRUSTING, "samples after a stamp 1000 s ahead speed is"),
        (CHANGED, "samples after a stamp 1000 s ahead speed is"),
        (NOW, "samples after a stamp 1000 s ahead speed is"),
    ],
)
def test_a_block_that_believes_a_stamp_that_cannot_be_is_told(
    rule: str, sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(AssertionError) as caught:
        CHECKS["outlives_hostile_stamps"](Subject(block(tmp_path, STAMPED.replace("NEWS", rule))))
    assert sentence in str(caught.value)


@pytest.mark.parametrize(("name", "before", "after", "sentence"), FAULTS)
def test_each_check_catches_its_fault(
    name: str, before: str, after: str, sentence: str, tmp_path: Path
) -> None:
    assert GOOD.count(before) == 1
    with pytest.raises(AssertionError) as caught:
        CHECKS[name](Subject(block(tmp_path, GOOD.replace(before, after))))
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("after", "sentence"),
    [
        ("        self.count = (self.count + 3) * 2**62 % 1000003", "update at step 0: count is"),
        ("        self.count += len(vars(self))", "Untyped global name 'vars'"),
    ],
)
def test_a_method_that_does_not_compile_to_the_same_is_told(
    after: str, sentence: str, tmp_path: Path
) -> None:
    numba = pytest.importorskip("numba")
    with pytest.raises((AssertionError, numba.core.errors.NumbaError)) as caught:
        CHECKS["compiles"](Subject(block(tmp_path, GOOD.replace(COUNT, after))))
    assert sentence in str(caught.value)


def test_blocks_that_are_not_numeric_need_not_compile(tmp_path: Path) -> None:
    text = GOOD.replace("Fan(Block)", "Fan(Block, numeric=False)").replace(
        COUNT, "        self.count += len(vars(self))"
    )
    CHECKS["compiles"](Subject(block(tmp_path, text)))


def test_everything_that_is_wrong_is_told_at_once(tmp_path: Path) -> None:
    text = GOOD.replace("towards its command.", "").replace("Fan(Block)", "Fan(Block, numeric=False)")
    text = text.replace(COUNT, "        self.count += self.blades / 0")
    with pytest.raises(AssertionError) as caught:
        check_block(block(tmp_path, text))
    lines = str(caught.value).splitlines()
    assert lines[0].startswith("Fan: documented: the docstring's first line must be a sentence")
    assert any("a division by zero" in line for line in lines[1:])
