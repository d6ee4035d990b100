"""The live page of a target: a gateway between browsers on this computer and the target, and the page itself."""
