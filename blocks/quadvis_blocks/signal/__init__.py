"""Blocks that shape signals: arithmetic, delays, holds, filters, integrals and derivatives."""
