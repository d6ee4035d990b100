"""From four centres in a picture to the pose of the craft."""
