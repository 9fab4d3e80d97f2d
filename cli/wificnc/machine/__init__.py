"""Machine profiles: steps/mm, speeds, travel and switches of a machine by readable names, as controller settings."""

from wificnc.machine.load import check_machine, find_machines, load_machine
from wificnc.machine.model import Machine

__all__ = ["Machine", "check_machine", "find_machines", "load_machine"]
