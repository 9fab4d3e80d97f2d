"""A job on its way to a machine: the program's lines, how long they take, where to resume, and the run itself."""
