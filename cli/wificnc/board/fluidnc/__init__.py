"""Configurations of FluidNC as board files and machine profiles: read as facts, and what was not taken is listed."""
