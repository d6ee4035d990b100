"""Functional mock-up units as blocks."""
