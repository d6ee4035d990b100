"""Blocks that compute the quantities of the control laws from measurements."""
