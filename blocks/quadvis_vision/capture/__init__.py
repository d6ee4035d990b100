"""Cameras: devices found, opened within time limits, set up, and read by a process of their own."""
