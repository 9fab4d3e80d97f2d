"""The page in the browser: what it must know of settings, boards and words (tables), as a file it is built with."""
