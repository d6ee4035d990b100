"""Scopes against a model that works sample by sample, for random settings, signals, commands and cuts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.scopes.settings import ScopeSettings
from tests.quadvis.scopes.model import BLOCKS, Command, World, board, facts, model

TICKS = 60
SIGNALS = ("fast.x", "fast.v", "fast.v[1]", "mid.n", "twin.y", "slow.on", "slow.z")
SCALARS = tuple(name for name in SIGNALS if name != "fast.v")


@st.composite
def worlds(draw: st.DrawFn) -> World:
    """Rows of small whole numbers, so that levels are met and crossed; some ticks are left out."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    missing = set(draw(st.lists(st.integers(0, TICKS - 1), max_size=8)))
    rows: dict[str, dict[int, list[float]]] = {}
    for block, (ports, period, offset) in BLOCKS.items():
        own = missing | set(draw(st.lists(st.integers(0, TICKS - 1), max_size=2)))
        size = sum(port.size for port in ports)
        ticks = [tick for tick in range(offset, TICKS, period) if tick not in own]
        rows[block] = {tick: random.integers(-2, 3, size).astype(float).tolist() for tick in ticks}
    return World(rows, TICKS)


@st.composite
def scopes(draw: st.DrawFn, number: int, count: int) -> ScopeSettings:
    modes = ["FreeRun", "Software", "Signal", "Signal", *(["Scope"] * 4 if count > 1 else [])]
    samples = draw(st.integers(1, 7))
    return ScopeSettings(
        Type=draw(st.sampled_from(["host", "target"])),
        Signals=tuple(draw(st.lists(st.sampled_from(SIGNALS), min_size=1, max_size=4, unique=True))),
        NumSamples=samples,
        NumPrePostSamples=draw(st.integers(-samples, 5)),
        Decimation=draw(st.integers(1, 3)),
        TriggerMode=draw(st.sampled_from(modes)),
        TriggerSignal=draw(st.sampled_from(SCALARS)),
        TriggerLevel=draw(st.sampled_from([-1.0, 0.0, 0.5])),
        TriggerSlope=draw(st.sampled_from(["Either", "Rising", "Falling"])),
        TriggerScope=draw(st.sampled_from([each for each in range(1, count + 1) if each != number] or [0])),
        TriggerSample=draw(st.sampled_from([-1, -1, -1, 0, 0, 1, 2, 3, 5, 8])),
        AutoRestart=draw(st.booleans()),
    )


@st.composite
def boards(draw: st.DrawFn) -> tuple[list[ScopeSettings], list[Command]]:
    count = draw(st.integers(1, 3))
    settings = [draw(scopes(number, count)) for number in range(1, count + 1)]
    starts = [Command(draw(st.integers(0, 12)), number, "start") for number in range(1, count + 1)]
    more = st.builds(
        Command,
        st.integers(0, TICKS),
        st.integers(1, count),
        st.sampled_from(["trigger", "trigger", "trigger", "start", "start", "stop"]),
    )
    return settings, sorted([*starts, *draw(st.lists(more, max_size=12))], key=lambda each: each.tick)


cuts = st.lists(st.integers(1, TICKS - 1), max_size=12)


@given(worlds(), boards(), cuts, st.integers(0, 9))
def test_a_board_hands_on_what_a_model_finds_sample_by_sample(
    world: World, given_: tuple[list[ScopeSettings], list[Command]], cuts: list[int], ahead: int
) -> None:
    settings, commands = given_
    made, packages = board(world, settings, commands, cuts, ahead)
    for each in model(world, settings, commands):
        assert facts(packages, each.number) == each.packages
        assert made[each.number].status == each.status


@given(worlds(), boards(), cuts, st.integers(0, 30))
def test_packages_do_not_depend_on_how_rows_are_cut(
    world: World, given_: tuple[list[ScopeSettings], list[Command]], cuts: list[int], ahead: int
) -> None:
    whole, pieces = board(world, *given_)[1], board(world, *given_, cuts, ahead)[1]
    for number in range(1, 4):
        assert facts(pieces, number) == facts(whole, number)


@pytest.mark.slow
@given(st.data())
def test_each_single_tick_by_itself_gives_the_same_packages(data: st.DataObject) -> None:
    world, given_ = data.draw(worlds()), data.draw(boards())
    whole, single = board(world, *given_)[1], board(world, *given_, list(range(TICKS)))[1]
    for number in range(1, 4):
        assert facts(single, number) == facts(whole, number)
