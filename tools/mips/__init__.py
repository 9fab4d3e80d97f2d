"""The PIC32MZ's image as machine code: what its interrupt handlers may do, and how long they take at most."""
