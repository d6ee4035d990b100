"""Models of the craft and of the air that it flies in, for simulation."""
