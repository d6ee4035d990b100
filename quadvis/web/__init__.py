"""The live page of a target: a gateway between browsers and the target, and the page."""
