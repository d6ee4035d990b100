"""Blocks that compute functions of values: products, matrices, trigonometry, extremes, rounding, kinds."""
