"""Pictures of packages as text, on exact small pictures."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.scopes.axes import number_text, round_axis, round_step
from quadvis.scopes.braille import STYLES, DotGrid
from quadvis.scopes.package import Package
from quadvis.scopes.panel import panel
from quadvis.scopes.settings import ScopeSettings

NUMERICAL = ScopeSettings(Type="target", Mode="numerical")
BARE = ScopeSettings(Type="target", Grid=False)


def package(samples: object, units: str = "m", step: float = 0.01, trigger: int | None = None) -> Package:
    values = np.array(samples, float)
    values = values[:, None] if values.ndim == 1 else values
    ticks = np.arange(len(values))
    names = tuple(f"craft.position[{column}]" for column in range(values.shape[1]))
    return Package(1, 0, ticks, ticks * step, values, names, tuple(units.split()), trigger)


def lines(grid: DotGrid) -> list[str]:
    return ["".join(text or " " for text, _ in grid.line(number)) for number in range(grid.height)]


def test_dots_lie_two_wide_and_four_high_in_a_cell() -> None:
    grid = DotGrid(2, 1)
    for dot in range(8):
        one = DotGrid(1, 1)
        one.draw(np.array([float(dot % 2)]), np.array([float(dot // 2)]), 0)
        assert lines(one) == ["⠁⠈⠂⠐⠄⠠⡀⢀"[dot]]
    grid.draw(np.array([0.0, 3.0]), np.array([0.0, 3.0]), 7)
    assert lines(grid) == ["⠑⢄"]
    assert grid.line(0) == [("⠑", 7), ("⢄", 7)]


def test_a_line_is_interrupted_by_nan_and_cut_at_the_border() -> None:
    grid = DotGrid(4, 1)
    grid.draw(np.arange(8.0), np.array([0, 0, 0, np.nan, 0, 0, 0, -1e9]), 0)
    assert lines(grid) == ["⠉⠁⠉⠁"]


def test_styles_leave_dots_out() -> None:
    found = []
    for style in STYLES:
        grid = DotGrid(8, 1)
        grid.draw(np.array([0.0, 15.0]), np.array([0.0, 0.0]), 0, style)
        found += lines(grid)
    assert found == ["⠉⠉⠉⠉⠉⠉⠉⠉", "⠉⠉⠁ ⠉⠉⠁ ", "⠁⠈ ⠁⠈ ⠁⠈", "⠉⠉⠁⠈ ⠉⠉⠁"]


def test_many_samples_in_a_column_keep_their_least_and_greatest() -> None:
    values = np.full(4000, 1.5)
    values[777], values[2222] = 0.0, 3.0
    grid = DotGrid(2, 1)
    grid.draw(np.linspace(0, 3, 4000), values, 0)
    shown = "".join(lines(grid))
    assert len(shown) == 2
    assert {0, 3} <= {bit for cell in shown for bit in rows_of(cell)}


def rows_of(cell: str) -> set[int]:
    bits = ord(cell) - 0x2800
    return {row for row, mask in enumerate((0x09, 0x12, 0x24, 0xC0)) if bits & mask}


def test_a_small_picture() -> None:
    shown = panel(package([0, 1, 2, 1, 0, 1, 2, 1, 0]), 40, 8, BARE)
    assert shown.splitlines() == SMALL


SMALL = """\
━━━━ craft.position[0]
2 m┤       ⢀⠔⠑⢄              ⡠⠊⠢⡀
   │      ⡠⠃   ⠣⡀          ⢀⠎   ⠈⢆
1  ┤    ⡠⠊      ⠈⠢⡀      ⢀⠔⠁      ⠑⢄
   │  ⡠⠊          ⠈⠢⡀   ⡔⠁          ⠑⢄
0  ┤⡠⠊              ⠈⠢⡠⠊              ⠑⢄
   └┬─────────────────────┬─────────────
  0.00                  0.05           s
""".splitlines()


def test_the_unit_stands_at_the_top_and_the_trigger_on_the_axis_of_time() -> None:
    shown = panel(package([0, 5, 10, 15], "deg", trigger=2), 40, 12).splitlines()
    assert shown[1].startswith("15 deg┤")
    assert [line.partition("┤")[0].strip() for line in shown if "┤" in line] == ["15 deg", "10", "5", "0"]
    assert shown[-1].split() == ["0.00", "0.02", "s"]
    left, right = shown[-2].index("└") + 1, len(shown[-2]) - 1
    assert shown[-2].index("▲") == round(left + (right - left) * 2 / 3)


def test_without_colours_traces_of_a_unit_differ_by_their_lines() -> None:
    waves = np.stack([np.sin(np.arange(100) / 9), np.cos(np.arange(100) / 9)], 1)
    plain = panel(package(waves, "m m"), 60, 14)
    assert plain.splitlines()[0] == "━━━━ craft.position[0]   ╍╍╍╍ craft.position[1]"
    assert "\x1b" not in plain
    coloured = panel(package(waves, "m m"), 60, 14, colours=True)
    assert coloured.splitlines()[0] == (
        "\x1b[36m━━━━\x1b[0m craft.position[0]   \x1b[33m━━━━\x1b[0m craft.position[1]"
    )
    assert set(re.findall("\x1b\\[(\\d+)m", coloured)) == {"0", "36", "33"}


def test_each_unit_has_its_own_axes_and_all_share_the_time() -> None:
    both = np.stack([np.arange(9.0), np.arange(9.0) * 100], 1)
    shown = panel(package(both, "m rad/s"), 60, 20).splitlines()
    assert [line for line in shown if "━━━━" in line] == ["━━━━ craft.position[0]", "━━━━ craft.position[1]"]
    assert sum("└" in line for line in shown) == 1
    assert any(line.startswith("1000 rad/s┤") for line in shown)
    low = panel(package(both, "m rad/s"), 60, 11)
    assert "least" in low  # too low for two pairs of axes


def test_numbers_as_a_table() -> None:
    shown = panel(package([[1, 10], [3, 20], [2, 15]], "m 1"), settings=NUMERICAL)
    assert shown.splitlines() == [
        "t                  0.02  s  least  greatest",
        "craft.position[0]     2  m  1      3",
        "craft.position[1]    15     10     20",
    ]


def test_limits_that_are_given_are_the_ends_of_the_axis() -> None:
    limited = ScopeSettings(Type="target", YLimit=(-1, 1))
    shown = panel(package([-5, 5, -5]), 40, 12, limited).splitlines()
    assert [line.partition("┤")[0].strip() for line in shown if "┤" in line][::2] == ["1.0 m", "0.0", "-1.0"]


@pytest.mark.parametrize(
    "least, greatest, most, marks",
    [
        (0.0, 10.0, 4, ["0", "5", "10"]),
        (-0.93, 0.97, 4, ["-1.0", "-0.5", "0.0", "0.5", "1.0"]),
        (1.5001, 1.5009, 4, ["1.5000", "1.5002", "1.5004", "1.5006", "1.5008", "1.5010"]),
        (3.0, 3.0, 3, ["1", "2", "3", "4", "5"]),
        (0.0, 0.0, 3, ["-1", "0", "1"]),
        (0.0, 3e-9, 3, ["0", "1e-09", "2e-09", "3e-09"]),
        (0.0, 2e9, 2, ["0", "1e+09", "2e+09"]),
        (-250.0, 1000.0, 3, ["-500", "0", "500", "1000"]),
    ],
)
def test_axes_have_round_numbers(least: float, greatest: float, most: int, marks: list[str]) -> None:
    axis = round_axis(least, greatest, most)
    assert [axis.text(mark) for mark in axis.marks] == marks


@given(st.floats(1e-12, 1e12), st.integers(1, 20))
def test_a_round_step_is_1_2_or_5_and_the_least_that_fits(span: float, most: int) -> None:
    step = round_step(span, most)
    assert number_text(step, step).strip("0.").partition("e")[0] in ("1", "2", "5")
    assert span / step <= most * (1 + 1e-6)
    assert span / (step / 2.5) > most * (1 - 1e-6)


numbers = st.floats() | st.sampled_from([0.0, 1.0, -1.0, 1e300, -1e308, 5e-324])


@given(
    st.lists(st.tuples(numbers, numbers), max_size=30),
    st.sampled_from(["m m", "m 1", "deg rad/s^2"]),
    st.integers(0, 120),
    st.integers(0, 40),
    st.booleans(),
)
def test_any_samples_give_a_picture_that_fits(
    samples: list[tuple[float, float]], units: str, width: int, height: int, colours: bool
) -> None:
    shown = panel(package(np.array(samples).reshape(-1, 2), units), width, height, colours=colours)
    found = re.sub("\x1b\\[\\d+m", "", shown).splitlines()
    assert 1 <= len(found) <= max(8, height)
    if not any("least" in line for line in found):
        assert max(map(len, found)) <= max(40, width)
