"""The repository's own rules, each a function from the tree to a list of problems. `python -m lint` runs them all."""
