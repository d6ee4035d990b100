"""The colours of the four circles relative to the ceiling, and the file that holds them.

A circle's colour is the ratio of its grey levels to the ceiling's, channel by channel: exposure, white
balance and vignetting change both in the same way. Source: the colour calibration of section 5.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadvis.document import YamlNode, dump_yaml, read_fields
from quadvis.errors import DiagramError, Fault, Faults, QuadvisError, sentence
from quadvis.machine.files import Kind, write_output
from quadvis_vision.camera.provenance import CalibrationError
from quadvis_vision.detection.colour_provenance import KEYS, ColourEvidence

Array = NDArray[np.float64]
Colour = tuple[float, float, float]

NAMES = ("red", "blue", "green", "black")  # of corners 1..4 of the paper's target
THRESHOLD = 0.74

_DARK = 0.2  # a ratio far below this counts as black
_RATIO_MAX = 3.0
APART = 0.3  # least distance between two colours: a step of a third in one channel

NOTHING_KNOWN = ColourEvidence()
COLOURS = Kind("the colours", pattern=rb"^circles:")


@dataclass(frozen=True, eq=False)
class ColourCalibration:
    """Colours of circles 1..4; impossible values raise `QuadvisError`.

    `prototypes` (4, 3) are ratios of circle to ceiling, blue-green-red. A pixel may belong to a circle if one
    of its channels is below `threshold` times the ceiling. `names` are for messages only. `evidence` says how
    the colours were found, if known.
    """

    prototypes: Array
    threshold: float = THRESHOLD
    names: tuple[str, ...] = NAMES
    evidence: ColourEvidence = NOTHING_KNOWN

    def __post_init__(self) -> None:
        """Make the array read-only and check everything."""
        prototypes = np.array(self.prototypes, dtype=np.float64)
        if prototypes.shape != (4, 3) or len(self.names) != 4:
            raise QuadvisError(
                f"colours have shape {prototypes.shape}; four circles need 4 x 3 ratios and 4 names"
            )
        prototypes.flags.writeable = False
        object.__setattr__(self, "prototypes", prototypes)
        for _, problem, remedy in _problems(prototypes, self.threshold, self.names):
            raise QuadvisError(sentence(problem, remedy))
        self.evidence.check(prototypes, self.distances)

    @classmethod
    def load(cls, path: str | Path) -> ColourCalibration:
        """Read a colour file; `DiagramError` with file, line and column of every fault in it.

        The file is YAML: `threshold: 0.74` and `circles`, a list of four `{colour: red, ratio: [blue,
        green, red]}` in the order of corners 1 to 4; optionally also `date`, and `rms`, `errors: [of each
        picture]` and `samples: [four ratios of each picture]`, which must agree with each other and with the
        ratios.
        """
        fields = read_fields(path, "a file of colours", ("threshold", "circles"), KEYS)
        circles = fields["circles"].items()
        if len(circles) != 4:
            raise fields["circles"].wrong("a list of 4 circles", found=f"a list of {len(circles)}")
        maps = [circle.fields(required={"colour", "ratio"}) for circle in circles]
        names = tuple(circle["colour"].text() for circle in maps)
        prototypes = np.array([circle["ratio"].array((3,)) for circle in maps], dtype=np.float64)
        threshold = fields["threshold"].number()
        places: list[YamlNode] = [*(circle["ratio"] for circle in maps), fields["threshold"]]
        faults = Faults()
        for index, problem, remedy in _problems(prototypes, threshold, names):
            faults.add(places[index].place, problem, remedy, subject="colours")
        faults.check()
        try:
            return cls(prototypes, threshold, names, ColourEvidence.read(fields))
        except CalibrationError as error:
            fault = Fault(fields[error.field].place, "colours", error.problem, error.remedy)
            raise DiagramError([fault]) from None

    def save(self, path: str | Path, comment: str = "") -> None:
        """Write the colours as YAML so that `load` returns the same numbers; `comment` goes on top."""
        lines = [f"# {line}" for line in comment.splitlines()]
        lines += [f"threshold: {float(self.threshold)!r}", "circles:"]
        for name, ratio in zip(self.names, self.prototypes, strict=True):
            parts = ", ".join(repr(float(part)) for part in ratio)
            lines.append(f"  - {{colour: {json.dumps(name)}, ratio: [{parts}]}}")
        facts = self.evidence.facts()
        text = "\n".join(lines) + "\n" + (dump_yaml(facts) if facts else "")
        write_output(path, COLOURS, text)

    @cached_property
    def ratios(self) -> tuple[Colour, ...]:
        """The prototypes as tuples."""
        return tuple((float(blue), float(green), float(red)) for blue, green, red in self.prototypes)

    def nearest(self, ratio: Colour) -> tuple[int, float]:
        """Return the index of the circle whose colour is nearest to a ratio, and the distance.

        The distance is nearly that of the logarithms. So a factor common to all channels counts little, such
        as a ceiling that is greyer than the calibrated one, and so do differences between dark tones.
        """
        place = tone(ratio)
        distances = [math.dist(place, other) for other in self._tones]
        least = min(distances)
        return distances.index(least), least

    def distances(self, ratios: Array) -> Array:
        """Return the distances (n, 4) of ratios (n, 4, 3) from the colours of circles 1 to 4."""
        off = np.log(ratios + _DARK) - np.log(self.prototypes + _DARK)
        return np.asarray(np.linalg.norm(off, axis=-1))

    @cached_property
    def _tones(self) -> tuple[Colour, ...]:
        return tuple(tone(ratio) for ratio in self.ratios)


def tone(ratio: Colour) -> Colour:
    """Return a ratio as a point; the distance of two points is the distance of the colours, see `nearest`."""
    blue, green, red = ratio
    return math.log(blue + _DARK), math.log(green + _DARK), math.log(red + _DARK)


def _problems(prototypes: Array, threshold: float, names: tuple[str, ...]) -> Iterator[tuple[int, str, str]]:
    """Yield for each fault the index of its circle (4: the threshold), the problem and the remedy."""
    if not 0.1 <= threshold <= 0.95:
        yield 4, f"threshold is {threshold:g}", "it must be from 0.1 to 0.95 of the ceiling's brightness"
        return
    good = []
    for index, (name, ratio) in enumerate(zip(names, prototypes, strict=True)):
        if not ((ratio >= 0) & (ratio <= _RATIO_MAX)).all():
            numbers = ", ".join(f"{part:g}" for part in ratio)
            yield index, f"the ratio of {name} is ({numbers})", f"each must be from 0 to {_RATIO_MAX:g}"
        elif ratio.min() >= threshold:
            problem = f"{name} is in no channel below the threshold {threshold:g}, so it cannot be found"
            yield index, problem, "raise the threshold or take a darker colour"
        else:
            good.append(index)
    for place, later in enumerate(good):
        for earlier in good[:place]:
            if math.dist(tone(tuple(prototypes[later])), tone(tuple(prototypes[earlier]))) < APART:
                yield (
                    later,
                    f"{names[later]} cannot be told from {names[earlier]}",
                    "the four colours must differ",
                )
