"""Firmware of flight controllers in the loop, as processes of their own, and what stands in for it on the desk."""
