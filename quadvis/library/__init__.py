"""Find blocks by name, describe them, and write skeletons of new ones."""
