"""Cards and boards with analog and digital channels: their drivers, their frames, and how they are read."""
