"""The way to a controller: bytes (transport), words (protocol), one conversation (client), many lines (stream)."""
