"""Rendered pictures of a simulated scene, and the faults of real pictures."""
