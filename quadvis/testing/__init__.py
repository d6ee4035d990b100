"""Tests of a block by itself: unit tests drive the block, the conformance suite checks the contract."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from quadvis.testing.drive import Driven, drive

if TYPE_CHECKING:
    from quadvis.testing.conformance import Subject, check_block
    from quadvis.testing.drive_output import DrivenOutput, drive_output

__all__ = ["Driven", "DrivenOutput", "Subject", "check_block", "drive", "drive_output"]

# Imported when they are first used: a test that only drives a block needs neither suite nor processes.
LATER = {
    "Subject": "conformance",
    "check_block": "conformance",
    "DrivenOutput": "drive_output",
    "drive_output": "drive_output",
}


def __getattr__(name: str) -> Any:
    """Import what is used."""
    if name not in LATER:
        raise AttributeError(f"module 'quadvis.testing' has no attribute '{name}'")
    found = getattr(import_module(f"quadvis.testing.{LATER[name]}"), name)
    globals()[name] = found  # in the place of the module of the same name, which the import has put there
    return found
