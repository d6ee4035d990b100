"""Bridges from a target to viewers of others: Foxglove, and PlotJuggler."""
