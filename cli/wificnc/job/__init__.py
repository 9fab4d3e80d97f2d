"""A job on its way to a machine: the program's lines, where to resume, and the run itself."""
