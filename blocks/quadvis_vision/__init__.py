"""The vision of the library, free of blocks: what they, the tools and the trials are made of."""
