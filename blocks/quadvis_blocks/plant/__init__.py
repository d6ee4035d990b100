"""Models of the craft, the air and the ground, for simulation."""
