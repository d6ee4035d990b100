"""From a checked graph to a running loop: memory, plan, solver, ticks."""
