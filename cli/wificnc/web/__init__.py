"""The page's files as a C header: the firmware of the ESP32 carries them."""
