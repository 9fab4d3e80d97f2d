"""Files that people and other programs write: read up to a size, checked in full, every fault with its line."""
