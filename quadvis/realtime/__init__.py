"""A run paced by the monotonic clock, in a process of its own that another one supervises."""
