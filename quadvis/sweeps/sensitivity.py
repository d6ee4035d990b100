"""How much of the spread of a number is due to each axis: the indices of Sobol, as SALib finds them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis.errors.caller import as_given
from quadvis.sweeps.designs import DESIGNS, SALTELLI, SAMPLED, Design, salib, unit_problem
from quadvis.sweeps.estimates import CONFIDENCE
from quadvis.sweeps.summary import shown_quantities
from quadvis.sweeps.table import Table
from quadvis.sweeps.worker import Quantity

FEWEST = 65  # runs, without Saltelli's scheme: what 10 harmonics take (Tissot and Prieur 2012)
RESAMPLES = 200


class Indices(NamedTuple):
    """The indices of one number, an entry for each axis, with the half widths of their 95 % intervals.

    ``first`` is the share of the variance that an axis explains by itself, ``total`` the share with all that
    it does together with others; they need Saltelli's scheme, and are None without it. ``runs`` is how many
    runs they are of.
    """

    quantity: Quantity
    first: NDArray[np.float64]
    first_width: NDArray[np.float64]
    total: NDArray[np.float64] | None
    total_width: NDArray[np.float64] | None
    runs: int


def refuse_unfit(design: Design) -> None:
    """Raise QuadvisError if a design does not show what is due to which axis, or SALib is missing."""
    if design.name not in SAMPLED:
        asked, remedy = (
            as_given("--sensitivity", "sensitivity"),
            as_given("--design saltelli", "design='saltelli'"),
        )
        raise QuadvisError(f"{asked} is for a sample, and not for '{DESIGNS[design.name]}'; give {remedy}")
    if design.name != SALTELLI and design.runs < FEWEST:
        remedy = f"give {as_given('--runs', 'runs')} {FEWEST} or more"
        raise QuadvisError(f"{design.runs} runs are too few for a sensitivity; {remedy}")
    salib("analyze")


def sensitivities(table: Table) -> list[Indices]:
    """Return the indices of each number that differs between the runs.

    Runs that stopped with an error are left out, in Saltelli's scheme with the others of their group.
    """
    found = []
    for quantity in shown_quantities(table):
        values = table[quantity.column]
        if np.isfinite(values).any() and np.nanstd(values[np.isfinite(values)]) > 0.0:
            each = _saltelli if table.design.name == SALTELLI else _harmonics
            indices = each(table, quantity, values)
            found += [indices] if indices is not None else []
    return found


def _saltelli(table: Table, quantity: Quantity, values: NDArray[np.float64]) -> Indices | None:
    axes = len(table.design.axes)
    groups = values.reshape(-1, axes + 2)
    kept = groups[np.isfinite(groups).all(axis=1)].reshape(-1)
    if len(kept) < 2 * (axes + 2) or not np.ptp(kept):
        return None
    found = salib("analyze.sobol").analyze(
        unit_problem(axes),
        kept,
        calc_second_order=False,
        num_resamples=RESAMPLES,
        conf_level=CONFIDENCE,
        seed=1,
    )
    first, first_width, total, total_width = (
        np.asarray(found[name], np.float64) for name in ("S1", "S1_conf", "ST", "ST_conf")
    )
    return Indices(quantity, first, first_width, total, total_width, len(kept))


def _harmonics(table: Table, quantity: Quantity, values: NDArray[np.float64]) -> Indices | None:
    """Find the first-order indices of any sample by RBD-FAST (Tarantola 2006, Plischke 2010)."""
    kept = np.isfinite(values)
    if np.count_nonzero(kept) < FEWEST:
        return None
    places = table.design.places(table.rows[kept])
    found = salib("analyze.rbd_fast").analyze(
        unit_problem(places.shape[1]),
        places,
        values[kept],
        num_resamples=RESAMPLES,
        conf_level=CONFIDENCE,
        seed=1,
    )
    first, width = (np.asarray(found[name], np.float64) for name in ("S1", "S1_conf"))
    return Indices(quantity, first, width, None, None, int(np.count_nonzero(kept)))
