"""What talks to a target: the object `Target`, bundles of diagrams, the console."""
