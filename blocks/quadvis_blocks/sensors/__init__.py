"""Models of the instruments on board, for simulation."""
