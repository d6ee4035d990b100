"""Picture files of any origin, and drawing into pictures."""
