"""A diagram, or a part of one, packed for other programs: C that needs nothing of quadvis, and FMUs made of it."""
