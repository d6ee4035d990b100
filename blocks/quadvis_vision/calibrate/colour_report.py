"""The results of a colour calibration: a table for people and JSON for programs."""

from __future__ import annotations

import json
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from quadvis_vision.detection.colours import APART, tone

if TYPE_CHECKING:
    from quadvis_vision.calibrate.colour_calibration import Calibrated

_WIDTH = 22  # of the column of pictures, at least


def header(found: Calibrated) -> str:
    """Return the comment at the top of a colour file."""
    count = len(found.names)
    pictures = "1 picture" if count == 1 else f"{count} pictures"
    return (
        f"By tools/calibrate_colours, from {pictures}: {', '.join(found.names)}.\n"
        "Colours of circles 1 to 4 over the ceiling's, [blue, green, red]; samples are those of each picture."
    )


def text(found: Calibrated) -> str:
    """Return the tables."""
    colours, evidence = found.colours, found.colours.evidence
    off = np.sqrt(np.mean(found.distances**2, axis=0)).tolist()
    lines = [f"{'corner':<8}{'colour':<10}{'blue':>8}{'green':>8}{'red':>8}{'rms off':>10}"]
    for corner, (name, ratio) in enumerate(zip(colours.names, colours.ratios, strict=True)):
        numbers = "".join(f"{part:8.3f}" for part in ratio)
        lines.append(f"{corner + 1:<8}{name:<10}{numbers}{off[corner]:10.3f}")
    first, second, apart = _nearest_two(found)
    lines.append(f"nearest: {first} and {second}, {apart:.2f} apart; {APART:g} is the least")
    width = max(_WIDTH, 2 + max(map(len, found.names)))
    corners = "".join(f"{corner:>8}" for corner in range(1, 5))
    lines += ["", f"{'picture, off by':<{width}}{corners}{'rms':>8}  found again"]
    assert evidence.errors is not None
    for name, row, rms, again in zip(
        found.names, found.distances, evidence.errors.tolist(), found.found, strict=True
    ):
        numbers = "".join(f"{part:8.3f}" for part in (*row.tolist(), rms))
        lines.append(f"{name:<{width}}{numbers}  {again} of 4")
    return "\n".join(lines)


def as_json(found: Calibrated) -> str:
    """Return all results; centres and radii are in px, ratios are blue, green, red."""
    colours = found.colours
    pictures = [
        {
            "name": name,
            "centres": [[disc.centre.real, disc.centre.imag] for disc in seen.discs],
            "radii": [disc.radius for disc in seen.discs],
            "ratios": ratios,
            "distances": row,
            "found_again": again,
        }
        for name, seen, ratios, row, again in zip(
            found.names,
            found.sightings,
            found.samples.tolist(),
            found.distances.tolist(),
            found.found,
            strict=True,
        )
    ]
    circles = [
        {"colour": name, "ratio": list(ratio)}
        for name, ratio in zip(colours.names, colours.ratios, strict=True)
    ]
    everything = {
        "threshold": colours.threshold,
        "circles": circles,
        "rms": colours.evidence.rms,
        "pictures": pictures,
        "warnings": list(found.warnings),
    }
    return json.dumps(everything, indent=2)


def _nearest_two(found: Calibrated) -> tuple[str, str, float]:
    """Return the names of the two colours nearest to each other, and their distance."""
    tones = {name: tone(ratio) for name, ratio in zip(found.colours.names, found.colours.ratios, strict=True)}
    pairs = [
        (float(np.linalg.norm(np.subtract(tones[a], tones[b]))), a, b) for a, b in combinations(tones, 2)
    ]
    apart, first, second = min(pairs)
    return first, second, apart
