"""The numbers of the states of vision and of their reasons, for all blocks that pass them on."""

from __future__ import annotations

from quadvis_blocks._stamps import NEWS, REPEATED, RESTARTED

FRESH, COAST, LEVEL, LAND = range(4)
NONE, NO_FRAMES, TARGET_LOST, REARMING, FROZEN, BAD_STAMP, CLOCK_RESTARTED, CONTRADICTED = range(8)


def trouble_of(verdict: int, before: int) -> int:
    """Return the trouble with the newest stamp, by its verdict; a repeated stamp keeps that of ``before``."""
    if verdict == REPEATED:
        return before
    if verdict == NEWS:
        return NONE
    return CLOCK_RESTARTED if verdict == RESTARTED else BAD_STAMP
