"""Many runs of one diagram: the grid, the processes, the table and its summary."""
