"""The results of a run - log, verdicts, words, figures - and drawings of diagrams."""
