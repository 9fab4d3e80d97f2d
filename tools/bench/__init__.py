"""What the controller costs: speed, instructions, memory. `python -m bench` prints it with its method."""
