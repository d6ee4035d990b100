"""One run of a diagram, and the words in which it is reported."""
