"""What tools/calibrate and tools/calibrate_colours do: from photographs to calibration files."""
