"""Blocks that decide who flies: manual and automatic mode, stale data, lost vision, landing."""
