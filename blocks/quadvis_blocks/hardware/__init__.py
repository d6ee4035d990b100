"""Devices: commands and measurements through serial ports, and what stands in for them."""
