"""The way to a controller: bytes (transport), Grbl's lines (grbl), one conversation (client), many lines
(character_counting). wmc3 is the binary protocol.
"""
