"""Colours without clicks: a picture in any light gives colours with which the detector works in any other."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from quadvis.errors import QuadvisError
from quadvis_vision.calibrate.colour_calibration import calibrate_colours
from quadvis_vision.calibrate.colour_names import HUES, named, nearest_name
from quadvis_vision.detection.circles import CircleTarget
from quadvis_vision.detection.colours import ColourCalibration
from quadvis_vision.detection.detect import search
from quadvis_vision.trials.scenery import CEILING, Condition
from quadvis_vision.trials.scenes import CONDITIONS, PAINT, RADIUS, shoot
from tests.stages import mostly_slow

SMALL, LARGE = (320, 240), (640, 480)
WHOLE = [name for name, condition in CONDITIONS.items() if not condition.missing and not condition.cover]
HOPELESS = [name for name in CONDITIONS if name not in WHOLE]
TRUE = np.array(PAINT) / CEILING  # in even light, as reflectances are
PAINTS = {  # blue, green, red
    "red": (42, 38, 188), "orange": (25, 110, 205), "yellow": (30, 195, 205), "green": (64, 138, 42),
    "cyan": (190, 170, 40), "blue": (168, 72, 30), "violet": (150, 45, 100), "magenta": (140, 40, 190),
    "black": (30, 30, 30),
}  # fmt: skip
ORDERS = [
    ("yellow", "magenta", "cyan", "black"),
    ("orange", "violet", "green", "black"),
    ("red", "yellow", "blue", "green"),
    ("orange", "blue", "magenta", "cyan"),
    ("black", "red", "violet", "yellow"),
]


def taken(name, size=SMALL, seed=1, paint=PAINT):
    condition = name if isinstance(name, Condition) else CONDITIONS[name]
    return shoot(np.random.default_rng(seed), size, condition, paint=paint)


def calibrate(*pictures, order=("red", "blue", "green", "black"), ratio=RADIUS):
    return calibrate_colours(pictures, [f"{n}.png" for n in range(1, len(pictures) + 1)], ratio, order)


def refusal(*pictures, **options):
    with pytest.raises(QuadvisError) as error:
        calibrate(*pictures, **options)
    said = str(error.value)
    assert "\n" not in said and len(said) < 250
    return said


@lru_cache
def album(name, size, count, paint=PAINT):
    rng = np.random.default_rng(20)
    return [shoot(rng, size, CONDITIONS[name], paint=paint) for _ in range(count)]


def seen_rightly(colours, size, count, names=tuple(CONDITIONS), paint=PAINT):
    """Return the share of pictures of these conditions that the detector sees rightly with some colours."""
    target = CircleTarget(colours, RADIUS, 2.0, 80.0)
    shots = [shot for name in names for shot in album(name, size, count, paint)]
    return np.mean([shot.right(search(shot.pixels, target).centres) for shot in shots])


def misplaced(found, shot):
    """Return the largest distance (px) of the circles from where they are."""
    centres = np.array([(disc.centre.real, disc.centre.imag) for disc in found.sightings[0].discs])
    return np.hypot(*(centres - shot.centres).T).max()


@pytest.mark.parametrize("name", WHOLE)
def test_one_picture_in_any_light_gives_colours_for_every_other_light(name):
    shot = taken(name)
    found = calibrate(shot.pixels)
    assert misplaced(found, shot) < 0.5
    assert found.found == (4,)
    assert seen_rightly(found.colours, SMALL, 1) >= 0.99


# One picture in each condition is tried above; these are the numbers.
FEW = [(name, size, [2]) for name in ("combined", "12 decoys") for size in (SMALL, LARGE)]
MANY = [
    (name, size, seeds) for name in WHOLE for size, seeds in ((SMALL, [2]), (LARGE, [2]), (SMALL, [3, 4]))
]


@pytest.mark.parametrize(
    ("name", "size", "seeds"), mostly_slow(FEW + [each for each in MANY if each not in FEW], quick=0, slow=4)
)
def test_colours_from_any_condition_see_99_of_100_pictures_of_all_conditions(name, size, seeds):
    shares = []
    for seed in seeds:
        shot = taken(name, size, seed)
        found = calibrate(shot.pixels)
        assert misplaced(found, shot) < 0.5
        shares.append(seen_rightly(found.colours, size, 2))
    assert np.mean(shares) >= (0.98 if name == "combined" else 0.99)


@pytest.mark.parametrize("size", [SMALL, LARGE])
def test_in_clear_light_the_ratios_are_those_of_the_paint(size):
    for seed in range(3):
        found = calibrate(taken("clean", size, seed).pixels)
        assert np.abs(found.colours.prototypes - TRUE).max() < 0.01
        assert not found.warnings


@pytest.mark.parametrize("name", ["light x0.3", "light x0.5", "warm", "cold", "vignette", "gradient", "near"])
def test_light_does_not_change_the_ratios(name):
    found = calibrate(taken(name).pixels)
    assert np.abs(found.colours.prototypes - TRUE).max() < 0.03


def test_a_ceiling_darker_than_the_paint_changes_no_colour_by_more_than_a_common_factor():
    found = calibrate(taken("grey ceiling").pixels)
    ratios = found.colours.prototypes / (np.array(PAINT) / CONDITIONS["grey ceiling"].ceiling)
    assert np.ptp(ratios) < 0.1 * ratios.mean()
    assert found.colours.prototypes.max() <= 1


@pytest.mark.parametrize("level", [160, 90, 75, 60])
def test_colours_from_a_dark_ceiling_find_the_circles_on_it(level):
    condition = Condition(ceiling=(float(level),) * 3)
    found = calibrate(taken(condition).pixels)
    target = CircleTarget(found.colours, RADIUS, 2.0, 80.0)
    for seed in range(2, 8):
        shot = taken(condition, seed=seed)
        assert shot.right(search(shot.pixels, target).centres)


@pytest.mark.parametrize("order", mostly_slow([(order,) for order in ORDERS], 1, slow=3))
def test_other_paints_are_found_and_named(order):
    paint = tuple(PAINTS[name] for name in order)
    for name in ("clean", "light x0.3", "warm", "noise 20", "12 decoys", "motion 8 px"):
        shot = taken(name, paint=paint)
        found = calibrate(shot.pixels, order=order)
        assert misplaced(found, shot) < 0.5
        assert found.colours.names == order
    clean = calibrate(taken("clean", paint=paint).pixels, order=order).colours
    assert np.abs(clean.prototypes - np.array(paint) / CEILING).max() < 0.02
    # Blue beside a grey ceiling looks like cyan beside a white one.
    names = tuple(name for name in CONDITIONS if name != "grey ceiling" or "cyan" not in order)
    assert seen_rightly(clean, SMALL, 1, names, paint) >= 0.96


def test_colours_that_only_their_own_ceiling_tells_apart_stay_as_they_are_with_a_warning():
    order = ("orange", "blue", "magenta", "cyan")
    paint = tuple(PAINTS[name] for name in order)
    shot = taken("grey ceiling", paint=paint)
    found = calibrate(shot.pixels, order=order)
    assert found.found == (4,)
    assert found.colours.prototypes.max() > 1.5
    assert any("ceiling is darker than the paint" in warning for warning in found.warnings)


def test_the_median_of_five_pictures_is_better_than_one():
    one, five = [], []
    for seed in range(5):
        pictures = [taken("noise 20", seed=100 * seed + n).pixels for n in range(5)]
        one.append(calibrate(pictures[0]).colours.prototypes - TRUE)
        five.append(calibrate(*pictures).colours.prototypes - TRUE)
    assert np.mean(np.square(five)) < 0.6 * np.mean(np.square(one))


def test_one_bad_picture_of_three_changes_little_and_is_told():
    pictures = [taken("clean", seed=seed).pixels for seed in (1, 2)]
    found = calibrate(*pictures, taken("light x1.7").pixels)
    assert np.abs(found.colours.prototypes - TRUE).max() < 0.01
    assert all(warning.startswith("3.png") for warning in found.warnings)
    assert "over-exposed" in found.warnings[0]
    assert found.distances[2].max() > 5 * found.distances[:2].max()


def test_a_target_that_is_turned_begins_with_the_same_corner():
    for seed in range(6):  # poses of any yaw
        shot = taken("12 decoys", seed=seed)
        assert misplaced(calibrate(shot.pixels), shot) < 0.5


@pytest.mark.parametrize("name", HOPELESS)
def test_less_than_four_whole_circles_are_refused(name):
    for seed in range(6):
        said = refusal(taken(name, seed=seed).pixels)
        assert said.startswith("1.png: ") and "four" in said


def test_the_picture_that_is_wrong_is_named():
    assert refusal(taken("clean").pixels, taken("1 missing").pixels).startswith("2.png: 3 circles")


def test_a_mirrored_picture_is_told_from_a_right_one():
    said = refusal(np.ascontiguousarray(taken("clean").pixels[:, ::-1]))
    assert "clockwise red, black, green, blue" in said and "mirrored" in said


def test_colours_that_are_not_those_of_the_order_are_named():
    order = ("yellow", "magenta", "cyan", "black")
    said = refusal(taken("clean", paint=[PAINTS[name] for name in order]).pixels)
    assert all(name in said for name in order) and "does not fit" in said


def test_a_grey_picture_is_refused():
    grey = taken("clean").pixels.mean(axis=2, keepdims=True).astype(np.uint8).repeat(3, axis=2)
    assert "no colours" in refusal(grey)


def test_a_picture_with_nearly_no_colours_is_refused():
    pixels = taken("clean").pixels.astype(float)
    pale = pixels.mean(axis=2, keepdims=True) + 0.05 * (pixels - pixels.mean(axis=2, keepdims=True))
    assert "1.png" in refusal(pale.round().astype(np.uint8))


@pytest.mark.parametrize("shape", [(0, 0, 3), (240, 320), (240, 320, 4), (20, 320, 3), (240, 320, 3)])
def test_what_shows_nothing_is_refused(shape):
    assert "1.png" in refusal(np.full(shape, 128, np.uint8))


def test_no_pictures_and_too_many_are_refused():
    picture = taken("clean").pixels
    assert "no pictures" in refusal()
    assert "6 pictures" in refusal(*[picture] * 6)


@pytest.mark.parametrize("ratio", [0.0, 0.5, math.nan])
def test_circles_that_would_overlap_are_refused(ratio):
    assert "half of the side" in refusal(taken("clean").pixels, ratio=ratio)


@pytest.mark.parametrize(
    ("order", "said"),
    [
        (("red", "blue", "green"), "four"),
        (("red", "blue", "green", "red"), "four"),
        (("red", "blue", "green", "blak"), "'black'"),
        (("red", "blue", "green", ""), "not known"),
    ],
)
def test_a_wrong_order_is_refused(order, said):
    assert said in refusal(taken("clean").pixels, order=order)


def test_circles_of_another_size_are_another_target():
    assert "1.png" in refusal(taken("clean").pixels, ratio=0.04)


def test_the_same_pictures_give_the_same_colours_to_the_bit():
    pictures = [taken("12 decoys", seed=seed).pixels for seed in (1, 2)]
    first, second = calibrate(*pictures), calibrate(*pictures)
    assert (first.colours.prototypes == second.colours.prototypes).all()
    assert first.sightings == second.sightings


def test_the_picture_stays_as_it_is():
    shot = taken("clean")
    before = shot.pixels.copy()
    calibrate(shot.pixels)
    assert (shot.pixels == before).all()


@pytest.mark.parametrize("hue", HUES)
def test_a_saturated_hue_has_its_own_name(hue):
    angle = math.radians(HUES[hue])
    red, green, blue = (0.5 + 0.4 * math.cos(angle - math.radians(turn)) for turn in (0, 120, 240))
    assert nearest_name((blue, green, red)) == hue
    assert named([(blue, green, red)], (hue,)) == (hue,)
    assert named([(0.15, 0.15, 0.15)], (hue,)) is None


def test_the_evidence_is_what_each_picture_told(tmp_path):
    found = calibrate(*(taken("noise 10", seed=seed).pixels for seed in range(3)))
    evidence = found.colours.evidence
    assert np.median(evidence.samples, axis=0) == pytest.approx(found.colours.prototypes, abs=1e-4)
    # By hand: the distance of logarithms of ratios, to which a fifth is added.
    tones = np.log(evidence.samples + 0.2) - np.log(found.colours.prototypes + 0.2)
    assert evidence.errors == pytest.approx(np.sqrt((tones**2).sum(axis=2).mean(axis=1)), abs=1e-3)
    found.colours.save(tmp_path / "colours.yaml", comment="a\nb")
    back = ColourCalibration.load(tmp_path / "colours.yaml")
    assert (back.prototypes == found.colours.prototypes).all()
    assert (back.evidence.samples == evidence.samples).all()
    assert (back.evidence.errors == evidence.errors).all() and back.evidence.rms == evidence.rms


def test_a_number_that_was_changed_in_the_evidence_is_refused():
    colours = calibrate(taken("clean", seed=1).pixels, taken("clean", seed=2).pixels).colours
    evidence = colours.evidence
    for change in (
        {"samples": evidence.samples + 0.05},
        {"errors": evidence.errors + 0.1},
        {"errors": evidence.errors[:1]},
        {"rms": math.nan},
        {"samples": None},
        {"date": "today"},
    ):
        with pytest.raises(QuadvisError):
            replace(colours, evidence=replace(evidence, **change))
