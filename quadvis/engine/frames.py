"""The frames of a state, in the list that holds all frames of a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any


class Frames(Sequence[Any]):
    """Some neighbouring frames of a list: a view, so that a frame put here is in the list."""

    def __init__(self, frames: list[Any], first: int, count: int) -> None:
        self._frames, self._places = frames, range(first, first + count)

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, index: Any) -> Any:
        """Return a frame, or a list of those that a slice selects."""
        places = self._places[index]
        return [self._frames[place] for place in places] if isinstance(index, slice) else self._frames[places]

    def __setitem__(self, index: int, frame: Any) -> None:
        self._frames[self._places[index]] = frame

    def fill(self, frames: Iterable[Any]) -> None:
        """Replace all; ValueError if there are more or fewer new frames than places."""
        given = list(frames)
        if len(given) != len(self):
            raise ValueError(f"{len(given)} frames for a state that holds {len(self)}")
        self._frames[self._places.start : self._places.stop] = given
