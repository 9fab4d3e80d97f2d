"""The documentation as a site: `python -m pages` in tools/, or `make docs`."""
