"""The colour calibration file: what is read, what is refused and where."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import DiagramError, QuadvisError
from quadvis_vision.detection.colours import ColourCalibration

REPO = Path(__file__).parents[3]
FILE = REPO / "diagrams/calib/colours.yaml"
GOOD = """\
threshold: 0.74
circles:
  - {colour: red, ratio: [0.22, 0.19, 0.90]}
  - {colour: blue, ratio: [0.82, 0.36, 0.14]}
  - {colour: green, ratio: [0.32, 0.65, 0.19]}
  - {colour: black, ratio: [0.17, 0.17, 0.17]}
"""


def faults(tmp_path, text):
    path = tmp_path / "colours.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DiagramError) as error:
        ColourCalibration.load(path)
    return [(fault.place.line, fault.place.column, str(fault)) for fault in error.value.faults]


def test_the_default_file_holds_the_colours_of_the_paper_in_the_order_of_its_corners():
    colours = ColourCalibration.load(FILE)
    assert colours.names == ("red", "blue", "green", "black")
    blue, green, red = colours.prototypes.T
    assert (
        red[0] > max(blue[0], green[0])
        and blue[1] > max(green[1], red[1])
        and green[2] > max(blue[2], red[2])
    )
    assert colours.prototypes[3].max() < 0.3


def test_what_is_saved_is_read_back_to_the_bit(tmp_path):
    rng = np.random.default_rng(0)
    prototypes = np.array([[0.2, 0.1, 0.9], [0.9, 0.2, 0.1], [0.1, 0.9, 0.2], [0.1, 0.1, 0.1]])
    colours = ColourCalibration(prototypes + rng.uniform(0, 0.1, (4, 3)), 2 / 3, ("a b", "x: y", "#c", '"d"'))
    colours.save(tmp_path / "colours.yaml", comment="two\nlines")
    back = ColourCalibration.load(tmp_path / "colours.yaml")
    assert (back.prototypes == colours.prototypes).all()
    assert (back.threshold, back.names) == (colours.threshold, colours.names)


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ("threshold: 0.74", "threshold: 1.5", (1, 12), "0.1 to 0.95"),
        ("threshold: 0.74", "threshold: bright", (1, 12), "number"),
        ("[0.82, 0.36, 0.14]", "[0.82, 0.96, 0.84]", (4, 27), "blue is in no channel below the threshold"),
        ("[0.82, 0.36, 0.14]", "[0.82, -0.36, 0.14]", (4, 27), "from 0 to 3"),
        ("[0.82, 0.36, 0.14]", "[0.82, 0.36]", (4, 27), "3 numbers"),
        ("[0.32, 0.65, 0.19]", "[0.80, 0.38, 0.14]", (5, 28), "green cannot be told from blue"),
        ("colour: green", "color: green", (5, 6), "colour"),
    ],
)
def test_a_mistake_is_shown_at_its_place(tmp_path, old, new, place, words):
    assert old in GOOD
    (line, column, text), *rest = faults(tmp_path, GOOD.replace(old, new))
    assert (line, column) == place and words in text and not rest


def test_three_circles_are_refused(tmp_path):
    (line, _, text), *_ = faults(tmp_path, GOOD.rsplit("  -", 1)[0])
    assert line == 3 and "4 circles" in text


def test_all_wrong_ratios_are_reported_together(tmp_path):
    text = GOOD.replace("[0.82, 0.36, 0.14]", "[0.9, 0.9, 0.9]").replace("[0.17, 0.17, 0.17]", "[9, 9, 9]")
    assert [line for line, _, _ in faults(tmp_path, text)] == [4, 6]


@pytest.mark.parametrize("prototypes", [np.full((4, 3), 0.2), np.zeros((3, 3)), np.full((4, 3), math.nan)])
def test_impossible_colours_are_refused_in_code_too(prototypes):
    with pytest.raises(QuadvisError):
        ColourCalibration(prototypes)


@given(
    corner=st.integers(0, 3),
    light=st.tuples(*(st.floats(5, 255),) * 3),
    grey=st.floats(0.75, 1.5),
)
def test_a_colour_is_told_whatever_light_falls_on_both_circle_and_ceiling(corner, light, grey):
    colours = ColourCalibration.load(FILE)
    ceiling = np.array(light)
    circle = (
        colours.prototypes[corner] * ceiling * grey
    )  # a ceiling that is greyer or whiter than the calibrated one
    assert colours.nearest(tuple((circle / ceiling).tolist()))[0] == corner
