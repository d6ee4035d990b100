"""Who takes what the loops of a real-time run note beside rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.realtime.tail import LogTopics

Whole = NDArray[np.int64]


class NoteTaker(NamedTuple):
    """Who takes what loops have noted, before the rows of later ticks; each takes a computer's name first.

    ``left_out`` takes the first and the count of each run of ticks that the loop left out (N, 2),
    ``releases`` what its tasks missed (N, 4), ``times`` the name of a task and its times (N, 4), as
    `quadvis.realtime.notes` has them. ``log`` says where all this goes, if a plain log takes it.
    """

    left_out: Callable[[str, Whole], None]
    releases: Callable[[str, Whole], None]
    times: Callable[[str, str, Whole], None]
    log: LogTopics | None = None
