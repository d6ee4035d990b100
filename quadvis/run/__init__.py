"""One run of a diagram, and its report."""
