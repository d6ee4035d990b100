"""One module for each key at the top of a diagram: its names, reading, schema, resolved form and row."""
