"""Parts of diagrams for other programs: C that needs nothing of quadvis, and FMUs that are made of it."""
