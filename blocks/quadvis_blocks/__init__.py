"""The block library of quadvis: one block per file, in groups that a diagram names as ``<group>.<block>``."""
