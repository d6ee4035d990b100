"""The designs of sweeps, which values the runs have; scipy and SALib draw them, the same ones each time."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadvis.errors import QuadvisError, quoted, suggestion
from quadvis.errors.caller import as_given
from quadvis.sweeps.axes import GRID, AnyAxis, Axis
from quadvis.sweeps.continuous import ContinuousAxis

MOST_RUNS = 1_000_000
LATIN, SOBOL, RANDOM, SALTELLI, ONE_AT_A_TIME = (
    "latin_hypercube", "sobol", "random", "saltelli", "one_at_a_time"
)  # fmt: skip
SAMPLED = (LATIN, SOBOL, RANDOM, SALTELLI)
DESIGNS: Mapping[str, str] = {
    GRID: "all combinations",
    LATIN: "Latin hypercube",
    SOBOL: "Sobol sequence",
    RANDOM: "random",
    SALTELLI: "Saltelli's scheme",
    ONE_AT_A_TIME: "one at a time",
}
ENDS = 2  # values that one-at-a-time takes of an axis of any value, unless it has more runs


class Design:
    """Which values each run of a sweep has; here the grid, all combinations, the last axis fastest.

    A row is the number of a run. Its place on an axis is that of `Axis` or `ContinuousAxis`; NaN means the
    diagram's own value.
    """

    name = GRID

    def __init__(self, axes: Sequence[AnyAxis], runs: int, key: str = "") -> None:
        """Keep the axes; ``key`` is equal for designs alone whose runs begin alike."""
        self.axes, self.runs = tuple(axes), runs
        self.key = repr((self.name, key, [axis.key for axis in axes]))

    def places(self, rows: ArrayLike) -> NDArray[np.float64]:
        """Return the places (N, axes) of these runs."""
        shape = tuple(len(axis.values) for axis in self.axes if isinstance(axis, Axis))
        indices: Any = np.unravel_index(np.asarray(rows, np.int64), shape)
        return np.stack(indices, axis=-1).astype(np.float64)

    def columns(self, rows: ArrayLike) -> dict[str, NDArray[Any]]:
        """Return the columns of the axes for these runs."""
        places = self.places(rows)
        return {axis.column: axis.cells(places[:, number]) for number, axis in enumerate(self.axes)}

    def where(self, row: int) -> str:
        """Return the values of a run as text: ``a=1 m, b=2``."""
        pairs = zip(self.axes, self.places([row])[0].tolist(), strict=True)
        found = [f"{axis.name}={axis.label(place)}" for axis, place in pairs if not math.isnan(place)]
        return ", ".join(found) or "all as in the diagram"


class SampledDesign(Design):
    """A design whose places (runs, axes) are drawn beforehand."""

    def __init__(self, name: str, axes: Sequence[AnyAxis], places: NDArray[np.float64], key: str) -> None:
        self.name = name
        super().__init__(axes, len(places), key)
        self._places = places

    def places(self, rows: ArrayLike) -> NDArray[np.float64]:
        """Return the places (N, axes) of these runs."""
        found: NDArray[np.float64] = self._places[np.asarray(rows, np.int64)]
        return found


def make_design(axes: Sequence[AnyAxis], name: str, runs: int | None, seed: int) -> Design:
    """Return the design of this name; a grid has all combinations, the other ones ``runs`` at most.

    With equal arguments it is the same. The runs of `RANDOM`, `SOBOL` and `SALTELLI` are also the first ones
    of the same design with more runs. QuadvisError if there is no such design, or it has too many or too few
    runs.
    """
    if name not in DESIGNS:
        remedy = suggestion(name, DESIGNS) or f"choose from {', '.join(DESIGNS)}"
        raise QuadvisError(f"there is no design {quoted(name)}; {remedy}")
    asked = as_given("--runs", "runs")
    if name == GRID:
        if runs is not None:
            raise QuadvisError(
                f"a grid has as many runs as it has points; leave {asked} out, or give a design"
            )
        return _limited(Design(axes, math.prod(len(axis.values) for axis in axes if isinstance(axis, Axis))))
    if runs is not None and runs < 1:
        raise QuadvisError(f"{runs} runs are none; give {asked} 1 or more")
    if name == ONE_AT_A_TIME:
        return _limited(_one_at_a_time(axes, runs))
    if runs is None:
        raise QuadvisError(
            f"the design {quoted(name)} has as many runs as are wanted; say how many with {asked}"
        )
    if runs > MOST_RUNS:
        raise QuadvisError(f"these are {runs} runs; at most {MOST_RUNS} go into one sweep")
    shares = _SHARES[name](len(axes), runs, seed % 2**32)
    places = np.stack([axis.at(shares[:, number]) for number, axis in enumerate(axes)], axis=-1)
    return SampledDesign(name, axes, places, repr((seed, len(places) if name == LATIN else None)))


def _limited(design: Design) -> Design:
    if design.runs > MOST_RUNS:
        raise QuadvisError(f"these are {design.runs} runs; at most {MOST_RUNS} go into one sweep")
    return design


def _latin_hypercube(axes: int, runs: int, seed: int) -> NDArray[np.float64]:
    from scipy.stats import qmc

    found: NDArray[np.float64] = qmc.LatinHypercube(axes, rng=np.random.default_rng(seed)).random(runs)
    return found


def _sobol(axes: int, runs: int, seed: int) -> NDArray[np.float64]:
    from scipy.stats import qmc

    with warnings.catch_warnings():  # a number of runs that is no power of two has its uses, too
        warnings.simplefilter("ignore", UserWarning)
        found: NDArray[np.float64] = qmc.Sobol(axes, rng=np.random.default_rng(seed)).random(runs)
    return found


def _random(axes: int, runs: int, seed: int) -> NDArray[np.float64]:
    return np.random.default_rng(seed).random((runs, axes))


def _saltelli(axes: int, runs: int, seed: int) -> NDArray[np.float64]:
    """Return N (axes + 2) runs, N the greatest power of two that fits, as Sobol's indices need them."""
    group = axes + 2
    if runs < 2 * group:
        remedy = f"it needs N x {group} with N a power of two, such as {64 * group}"
        raise QuadvisError(f"{runs} runs are too few for Saltelli's scheme over {axes} axes; {remedy}")
    count = 2 ** int(math.log2(runs // group))
    found: NDArray[np.float64] = salib("sample.sobol").sample(
        unit_problem(axes), count, calc_second_order=False, seed=np.random.default_rng(seed)
    )
    return found


def unit_problem(axes: int) -> dict[str, object]:
    """Return what SALib wants to know of so many axes, whose places are shares 0 to 1."""
    names = [str(number) for number in range(axes)]
    return {"num_vars": axes, "names": names, "bounds": [[0.0, 1.0]] * axes}


_SHARES: Mapping[str, Callable[[int, int, int], NDArray[np.float64]]] = {
    LATIN: _latin_hypercube, SOBOL: _sobol, RANDOM: _random, SALTELLI: _saltelli
}  # fmt: skip


def salib(module: str) -> Any:
    """Return a module of SALib; QuadvisError if it is not installed."""
    from importlib import import_module

    try:
        return import_module(f"SALib.{module}")
    except ImportError:
        remedy = "pip install 'quadvis[sensitivity]'"
        raise QuadvisError(f"Saltelli's scheme and sensitivities need the package SALib; {remedy}") from None


def _one_at_a_time(axes: Sequence[AnyAxis], runs: int | None) -> Design:
    """Return the run of the diagram's own values, then the values of each axis, all others as they are."""
    levels = [axis for axis in axes if not isinstance(axis, ContinuousAxis)]
    rest = len(axes) - len(levels)
    left = ENDS * rest if runs is None else runs - 1 - sum(len(axis.values) for axis in levels)
    if left < ENDS * rest or (left and not rest and runs is not None):
        wanted = 1 + sum(len(axis.values) for axis in levels) + ENDS * rest
        remedy = f"give {wanted}{' or more' if rest else ', or leave the number out'}"
        raise QuadvisError(f"{runs} runs are not what one at a time needs here; {remedy}")
    lines = [np.full((1, len(axes)), np.nan)]
    for number, axis in enumerate(axes):
        places = axis.spread(left // rest) if isinstance(axis, ContinuousAxis) else range(len(axis.values))
        lines.append(np.full((len(places), len(axes)), np.nan))
        lines[-1][:, number] = places
    return SampledDesign(ONE_AT_A_TIME, axes, np.concatenate(lines), repr(left))
