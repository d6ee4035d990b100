"""The parameters of a target as those of Foxglove: as a diagram writes them, "2.5 rad/s"."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from quadvis.bridge.follower import FollowedTarget
from quadvis.errors import QuadvisError
from quadvis.wire.finite import finite

READ_ONLY = "this bridge changes no parameters; start it with --tune"


class BridgedParameters:
    """Reads the parameters that can be tuned, and with ``tunes`` gives them values, all at one tick."""

    def __init__(self, target: FollowedTarget, tunes: bool) -> None:
        self._target, self._tunes = target, tunes

    def values(self, names: Sequence[str] = ()) -> dict[str, Any]:
        """Return the present values by name, of all that can be tuned if none is named.

        Names that mean nothing are left out; so is everything while nothing is loaded.
        """
        try:
            found = self._target.request("getparam", names=[])
        except QuadvisError:
            return {}
        return {name: finite(value, str) for name, value in found.items() if not names or name in names}

    def set(self, values: Mapping[str, Any]) -> None:
        """Give parameters values; QuadvisError if one is refused, and then all stay as they are."""
        if not self._tunes:
            raise QuadvisError(READ_ONLY)
        for name, value in values.items():
            if value is None:
                raise QuadvisError(f"the parameter '{name}' cannot be removed; give it a value")
        self._target.request("setparam", values=dict(values))
