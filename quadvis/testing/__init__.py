"""Tests of a block by itself: unit tests drive the block, the conformance suite checks the contract."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from quadvis.testing.drive import Driven, drive

if TYPE_CHECKING:
    from quadvis.testing.conformance import Subject, check_block

__all__ = ["Driven", "Subject", "check_block", "drive"]


def __getattr__(name: str) -> Any:
    """Import the conformance suite when it is first used; a test that only drives a block needs no suite."""
    if name not in ("Subject", "check_block"):
        raise AttributeError(f"module 'quadvis.testing' has no attribute '{name}'")
    from quadvis.testing import conformance

    return getattr(conformance, name)
