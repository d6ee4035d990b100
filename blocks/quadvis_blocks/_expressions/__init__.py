"""Expressions over signals: their kinds and units, and compiled functions made from their trees."""
