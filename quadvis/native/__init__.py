"""Methods of blocks compiled to machine code."""
