"""Blocks that make signals out of time, numbers and chance."""
