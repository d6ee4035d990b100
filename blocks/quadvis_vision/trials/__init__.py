"""Scenes and comparisons that measure detection and pose estimation."""
