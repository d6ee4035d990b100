"""Who flies: manual and automatic mode, stale data, what happens when the camera sees nothing, landing."""
