"""Builds: the core as a library for this computer, and the firmware of the boards."""
