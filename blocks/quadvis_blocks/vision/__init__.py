"""Vision: cameras, circle detection and pose from four coloured circles (sections 4 and 5 of the paper)."""
