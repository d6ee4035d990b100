"""Blocks that make signals from time, numbers and chance."""
