"""Builds: the host controller from a checkout, and later the images of the boards."""
