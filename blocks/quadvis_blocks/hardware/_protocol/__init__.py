"""Protocols of other people: described in a file or a format, found in bytes, and checked."""
