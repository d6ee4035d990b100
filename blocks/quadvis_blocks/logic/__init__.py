"""Blocks of truth values: comparison, gates, switches, edges, counters."""
