"""The camera model: intrinsics and lens, calibration files, projection, two planes."""
