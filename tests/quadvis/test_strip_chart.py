"""The picture of a sweep: whatever the names, no text is cut by the edge and none lies on another."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.output.canvas import blank_sheet
from quadvis.sweeps import strip_chart
from quadvis.sweeps.strip_chart import Cloud, StripPanel, Strips, draw_strips
from tests.stages import mostly_slow

LONG = "the_largest_angle_at_which_the_craft_may_still_be_flown"


@pytest.fixture
def sheets(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The sheets that are drawn."""
    found: list[Any] = []

    @contextmanager
    def kept(*arguments: Any, **more: Any) -> Iterator[Any]:
        with blank_sheet(*arguments, **more) as sheet:
            found.append(sheet)
            yield sheet

    monkeypatch.setattr(strip_chart, "blank_sheet", kept)
    return found


def strips(
    panels: int,
    places: list[str],
    series: list[str],
    runs: int = 6,
    name: str = LONG,
    limit: float | None = 0.5,
) -> Strips:
    rng = np.random.default_rng(1)
    passed = np.arange(runs) % 3 > 0
    return Strips(
        title=f"{name}/{name}",
        subtitle="6 seeds at some points: 40 of 60 runs passed, 3 stopped with an error",
        axis=f"{name} [rad/s]",
        places=places,
        series=series,
        legend=f"params, {name}",
        panels=[
            StripPanel(
                f"{name}_{number}.rms",
                "m",
                [[Cloud(rng.random(runs), passed) for _ in places] for _ in series],
                limit,
            )
            for number in range(panels)
        ],
        note="the same in all runs: " + ", ".join(f"{name}.count {number}" for number in range(20)),
    )


def numbers(count: int) -> list[str]:
    return [f"{number / 7:.4g}" for number in range(count)]


def names(count: int) -> list[str]:
    return [f"{LONG}_{number}" for number in range(count)]


CASES = {
    "one panel": strips(1, numbers(3), ["1 m", "2 m"]),
    "three panels": strips(3, numbers(6), numbers(5)),
    "four panels": strips(4, numbers(20), ["1 m"]),
    "long places": strips(3, names(3), numbers(3)),
    "many long places": strips(2, names(12), numbers(1)),
    "two long series": strips(3, numbers(4), names(2)),
    "many long series": strips(1, numbers(4), names(20)),
    "lonely": strips(2, numbers(8), names(3), runs=1),
    "no limit": strips(3, numbers(3), numbers(2), limit=None),
    "usual names": strips(3, numbers(3), ["1 m", "2 m"], name="lag"),
}


@pytest.mark.parametrize("case", mostly_slow(CASES, 4))
def test_texts_stay_on_the_page_and_clear_of_each_other(case: str, sheets: list[Any], tmp_path: Path) -> None:
    draw_strips(CASES[case], tmp_path / "x.png")
    (sheet,) = sheets
    renderer, page = sheet.canvas.get_renderer(), sheet.bbox
    heads = [text for axes in sheet.axes for text in (axes.title, axes._left_title, axes._right_title)]
    labels = [axes.xaxis.label for axes in sheet.axes]
    texts = [*sheet.texts, *sheet.legends, *(text for text in (*heads, *labels) if text.get_text())]
    boxes = [(text, text.get_window_extent(renderer)) for text in texts]
    boxes += [(axes, axes.get_window_extent(renderer)) for axes in sheet.axes]
    for text, box in boxes:
        assert page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1, text
    for (one, first), (other, second) in itertools.combinations(boxes, 2):
        across = min(first.x1, second.x1) - max(first.x0, second.x0)
        along = min(first.y1, second.y1) - max(first.y0, second.y0)
        lines = {getattr(text, "_linespacing", None) for text in (one, other)}
        assert across < 1.0 or along < (20.0 if None not in lines else 1.0), (one, other)
    ticks = [label for axes in sheet.axes for label in axes.get_xticklabels()]
    assert all(box.x0 >= page.x0 for box in (label.get_window_extent(renderer) for label in ticks))
    for axes in sheet.axes:
        assert axes.get_window_extent(renderer).height >= 1.2 * sheet.dpi
    assert len(sheet.legends) == (len(CASES[case].series) > 1)


def test_a_short_legend_stands_beside_the_title(sheets: list[Any], tmp_path: Path) -> None:
    draw_strips(CASES["usual names"], tmp_path / "x.png")
    (sheet,) = sheets
    renderer = sheet.canvas.get_renderer()
    title, legend = (part.get_window_extent(renderer) for part in (sheet.texts[0], sheet.legends[0]))
    assert legend.y1 > title.y0 and legend.x0 > title.x1
