"""Four coloured circles in a picture: colours, blobs, outlines, and the square that they form."""
