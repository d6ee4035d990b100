"""What stays on the machine that flies: applications, runs, parameter sets, logs, scopes."""
