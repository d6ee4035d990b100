"""From files to a checked graph: the format, parts and variants, and all checks."""
