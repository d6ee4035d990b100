"""The mathematics of vision, without blocks, for the blocks, the tools and the trials."""
