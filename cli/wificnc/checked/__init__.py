"""TOML files that people write: read with line numbers, checked in full, every problem reported together."""
