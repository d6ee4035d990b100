"""Read picture files of any origin, and draw into pictures."""
