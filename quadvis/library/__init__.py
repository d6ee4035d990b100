"""Blocks by their names: found, described, and begun."""
