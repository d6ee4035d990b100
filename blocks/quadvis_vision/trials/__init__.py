"""Scenes and comparisons by which the eyes are measured."""
