"""The documentation site: pages made from READMEs, docstrings and the catalogue, rendered by Sphinx."""
