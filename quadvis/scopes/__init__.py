"""Scopes as in xPC Target: packages of samples from the rows of a run, and pictures of them as text."""
