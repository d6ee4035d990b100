"""Descriptions of FMUs: what is read is what was written; whatever is wrong is one sentence with a line."""

from __future__ import annotations

import random
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import QuadvisError
from quadvis.fmi.archive import opened
from quadvis.fmi.description import FmuUnit, FmuVariable
from quadvis.fmi.markup import MarkupError, read_markup
from quadvis.fmi.reading import describe, read_fmu
from quadvis.fmi.signals import plain_name, signals
from quadvis.fmi.units import Units
from tests.fmus import models
from tests.fmus.builder import Var, description, replace

BALL = description(models.BALL, 2)


def test_a_description_is_read_as_it_was_written() -> None:
    found = describe(read_markup(BALL.encode()))
    assert (found.version, found.name, found.indicators) == (2, "BouncingBall", 1)
    assert found.cosimulation is not None and found.cosimulation.saves_state
    h, slope, *_, e = found.variables
    assert (h.kind, h.causality, h.start, h.unit, h.initial) == ("Float64", "output", (1.0,), "m", "exact")
    assert (slope.derivative_of, e.least, e.most, e.variability) == (1, 0.5, 1.0, "tunable")
    assert found.states == (2, 4)
    assert found.dependencies[2] == {3}
    assert found.units["m/s2"] == FmuUnit("m/s2", {"m": 1, "s": -2})
    assert not found.depends(h, e)


def test_fmpy_reads_the_same(tmp_path: Path) -> None:
    """All variables of all models: names, references, types, start values, causality."""
    from fmpy import read_model_description

    for model, version in (
        (models.BALL, 2), (models.FEEDTHROUGH2, 2), (models.FEEDTHROUGH3, 3), (models.UNITS, 3)
    ):  # fmt: skip
        text = description(model, version)
        path = tmp_path / "x.fmu"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", text)
        ours, theirs = read_fmu(str(path))[0], read_model_description(str(path), validate=False)
        assert len(ours.variables) == len(theirs.modelVariables) > 3
        for one, other in zip(ours.variables, theirs.modelVariables, strict=True):
            assert (one.name, one.reference) == (other.name, other.valueReference)
            assert (one.causality, one.variability) == (other.causality, other.variability)
            assert (one.unit or None) == other.unit
            if other.start is not None and one.start is not None and one.kind != "String":
                words = [str(value).lower() for value in one.start]
                assert (
                    list(map(float, words)) == list(map(float, other.start.split()))
                    if one.kind not in ("Boolean")
                    else words == other.start.split()
                )


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('fmiVersion="2.0"', 'fmiVersion="1.0"', "line 2: FMI '1.0' is not known here"),
        ('fmiVersion="2.0"', "", "line 2: fmiModelDescription has no 'fmiVersion'"),
        ('modelName="BouncingBall"', "", "has no 'modelName'"),
        ("fmiModelDescription", "html", "the root is 'html', not 'fmiModelDescription'"),
        ('start="0.7"', 'start="much"', "a start value of type Float64 cannot be 'much'"),
        ('min="0.5"', 'min="1_0"', "'min' of Real cannot be '1_0'"),
        ('valueReference="0"', 'valueReference="-1"', "the value reference -1 is no 32-bit number"),
        ('name="v"', 'name="h"', "the variable 'h' stands there twice"),
        ("<Unknown index=\"1\"", "<Unknown index=\"99\"", "there is no variable with the index 99"),
        ('canSerializeFMUstate="true"', 'canSerializeFMUstate="yes"', "cannot be 'yes'"),
        ("<Real", "<Complex", "this is no variable with a type"),
        ('<BaseUnit m="1"/>', '<BaseUnit m="1" factor="0"/>', "unit 'm' cannot have the factor 0"),
        ('<BaseUnit m="1"/>', '<BaseUnit m="one"/>', "'m' of BaseUnit cannot be 'one'"),
        ("<ModelVariables>", "<Variables>", "mismatched tag"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_sentence_with_its_line(before: str, after: str, words: str) -> None:
    assert before in BALL
    with pytest.raises(MarkupError) as caught:
        describe(read_markup(BALL.replace(before, after).encode()))
    assert words in str(caught.value) and str(caught.value).startswith("line ")


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_a_damaged_description_is_read_or_refused_in_a_sentence(seed: int, count: int) -> None:
    chance, text = random.Random(seed), bytearray(BALL.encode())
    for _ in range(count):
        place = chance.randrange(len(text))
        match chance.randrange(3):
            case 0:
                text[place] = chance.randrange(256)
            case 1:
                del text[place : place + chance.randrange(1, 20)]
            case _:
                text[place:place] = text[: chance.randrange(1, 40)]
    try:
        describe(read_markup(bytes(text)))
    except MarkupError as error:
        assert "\n" not in str(error)


@given(st.integers(0, 2**32 - 1))
def test_a_damaged_archive_is_read_or_refused_in_a_sentence(seed: int) -> None:
    chance = random.Random(seed)
    path = FOLDER / "damaged.fmu"
    data = bytearray(ARCHIVE)
    for _ in range(chance.randrange(1, 6)):
        place = chance.randrange(len(data))
        data[place : place + chance.choice((0, 1, 4))] = chance.randbytes(chance.choice((0, 1, 4)))
    path.write_bytes(data)
    try:
        with opened(str(path)) as archive:
            archive.description()
        read_fmu(str(path))
    except QuadvisError as error:
        assert "\n" not in str(error)


@pytest.fixture(autouse=True, scope="module")
def _archive(tmp_path_factory: pytest.TempPathFactory) -> None:
    global ARCHIVE, FOLDER
    FOLDER = tmp_path_factory.mktemp("damaged")
    with zipfile.ZipFile(FOLDER / "whole.fmu", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", BALL)
        archive.writestr("binaries/linux64/BouncingBall.so", bytes(1000))
        archive.writestr("resources/a/b.txt", "text")
    ARCHIVE = (FOLDER / "whole.fmu").read_bytes()


ARCHIVE, FOLDER = b"", Path()


def elements(*names: str, **more: object) -> list[tuple[str, tuple[int, ...]]]:
    """Return the names and sizes of the signals that variables are."""
    made = [
        FmuVariable(**{"index": 1, "reference": 1, "kind": "Float64", "causality": "input", "variability": "",
                       "initial": "", "name": name, **more})  # type: ignore[arg-type]
        for name in names
    ]  # fmt: skip
    return [(each.name, each.shape) for each in signals(made, Units({}), ())]


def test_elements_that_fill_an_array_are_one_signal() -> None:
    assert elements("u[1]", "u[2]", "u[3]") == [("u", (3,))]
    assert elements("u[0]", "u[1]") == [("u", (2,))]
    assert elements("m[1,1]", "m[1,2]", "m[2,1]", "m[2,2]", "x") == [("m", (2, 2)), ("x", ())]
    assert elements("u[1]", "u[3]") == [("u_1", ()), ("u_3", ())]
    assert elements("u[2]", "u[3]") == [("u_2", ()), ("u_3", ())]
    assert elements("u", "u[1]", "u[2]") == [("u", ()), ("u_1", ()), ("u_2", ())]
    assert elements("a[1].x", "a[2].x") == [("a_1_x", ()), ("a_2_x", ())]


@given(st.lists(st.text(max_size=12), max_size=8))
def test_names_are_plain_and_no_two_alike(stated: list[str]) -> None:
    taken = {"file", "close"}
    for name in stated:
        made = plain_name(name, taken)
        assert made.isidentifier() and made.isascii() and made not in taken
        taken.add(made)


def test_structural_sizes_of_fmi_3_come_from_their_variable() -> None:
    text = description(replace(models.FEEDTHROUGH3, variables=[
        Var("n", "UInt64", "structuralParameter", start=2, variability="fixed"),
        Var("v", causality="input", start=[1.0, 2.0], size=2),
    ]), 3).replace('<Dimension start="2"/>', '<Dimension valueReference="0"/>')  # fmt: skip
    found = describe(read_markup(text.encode()))
    assert found.variables[-1].dimensions == (2,)
    with pytest.raises(MarkupError, match="the size of 'v' is not known"):
        describe(read_markup(text.replace('valueReference="0"/>', 'valueReference="7"/>').encode()))
