"""The difference of two diagrams or of two runs, in words."""
