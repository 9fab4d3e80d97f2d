"""A host of the binary protocol: docs/protocol.md.

packing, layout, keys: bytes. packet: a header around them. stream: segments that arrive, whatever the network does,
without sockets or clocks. device: a controller on the network.
"""
