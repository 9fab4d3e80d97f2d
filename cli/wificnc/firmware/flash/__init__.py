"""Writing firmware to an ESP32: what goes where, whether it fits, the chip itself, and updates over the network."""
