"""Firmware of flight controllers in the loop, as processes of their own."""
