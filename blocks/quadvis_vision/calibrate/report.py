"""The results of a camera calibration: a table for people and JSON for programs."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

_WIDTH = 22  # of the first column
_INTRINSICS = ("fx", "fy", "skew", "cx", "cy")
_DEVIATION = "standard deviation"
_LENS = ("k1", "k2", "p1", "p2", "k3")


@dataclass
class Report:
    """Cameras (name, K, rms px), lenses by name, and views (name, rms px, and OpenCV's rms px if known).

    `deviations` are standard deviations by the names of the parameters: fx, k1 and so on. `cautions` are the
    warnings that also concern every user of the calibration.
    """

    cameras: list[tuple[str, Floats, float]] = field(default_factory=list)
    lenses: dict[str, Floats] = field(default_factory=dict)
    views: list[tuple[str, float, float | None]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    deviations: dict[str, float] = field(default_factory=dict)
    cautions: list[str] = field(default_factory=list)

    def header(self) -> str:
        """Return the comment at the top of a camera file."""
        found = [f"{name}: {' '.join(f'{number:.3f}' for number in _five(k))}" for name, k, _ in self.cameras]
        known = [self.deviations.get(name) for name in _INTRINSICS]
        numbers = " ".join("-" if value is None else f"{value:.3f}" for value in known)
        spread = [f"{_DEVIATION}: {numbers}"] if self.deviations else []
        first = f"By tools/calibrate; {' '.join(_INTRINSICS)} (px):"
        return "\n".join([first, *found, *spread, *self.cautioned()])

    def cautioned(self) -> list[str]:
        """Return the cautions as lines of a comment."""
        return [f"warning: {caution}" for caution in self.cautions]

    def text(self) -> str:
        """Return the tables."""
        lines = [_heads("", (*_INTRINSICS, "rms px"))]
        for name, k, rms in self.cameras:
            numbers = "".join(f"{number:10.3f}" for number in _five(k))
            lines.append(f"{name:<{_WIDTH}}{numbers}{rms:10.4f}")
        lines += self._spread(_INTRINSICS, 3)
        if self.lenses:
            lines += ["", _heads("", _LENS)]
            for name, lens in self.lenses.items():
                lines.append(f"{name:<{_WIDTH}}{''.join(f'{number:10.5f}' for number in lens)}")
            lines += self._spread(_LENS, 5)
        if self.views:
            width = max(_WIDTH, 1 + max(len(name) for name, _, _ in self.views))
            compared = any(theirs is not None for _, _, theirs in self.views)
            lines += ["", _heads("view", ("rms px", "OpenCV") if compared else ("rms px",), width)]
            for name, ours, theirs in self.views:
                lines.append(f"{name:<{width}}{ours:10.4f}{'' if theirs is None else f'{theirs:10.4f}'}")
        return "\n".join(lines)

    def _spread(self, names: tuple[str, ...], digits: int) -> list[str]:
        """Return the row of the standard deviations, if known; a dash for each parameter that was held."""
        if not self.deviations:
            return []
        known = [self.deviations.get(name) for name in names]
        numbers = ["-" if value is None else f"{value:.{digits}f}" for value in known]
        return [f"{_DEVIATION:<{_WIDTH}}{''.join(f'{number:>10}' for number in numbers)}"]

    def json(self) -> str:
        """Return all results; lengths are in pixels."""
        views = [
            {"name": name, "rms": ours} | ({} if theirs is None else {"OpenCV": theirs})
            for name, ours, theirs in self.views
        ]
        everything: dict[str, Any] = {
            "cameras": {name: {"K": k.tolist(), "rms": rms} for name, k, rms in self.cameras},
            "distortion": {name: lens.tolist() for name, lens in self.lenses.items()},
            "standard deviations": self.deviations,
            "views": views,
            "warnings": [*self.warnings, *self.cautions],
        }
        return json.dumps(everything, indent=2)


def _heads(first: str, names: tuple[str, ...], width: int = _WIDTH) -> str:
    return f"{first:<{width}}" + "".join(f"{name:>10}" for name in names)


def _five(k: Floats) -> tuple[float, ...]:
    """Return fx, fy, skew, cx, cy."""
    return tuple(map(float, (k[0, 0], k[1, 1], k[0, 1], k[0, 2], k[1, 2])))
