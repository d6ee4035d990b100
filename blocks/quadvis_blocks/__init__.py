"""The block library of quadvis: one block per file. A diagram names a block as ``<group>.<block>``."""
