"""Rotations: quaternions, direction cosine matrices, Euler angles, and vectors turned by them."""
