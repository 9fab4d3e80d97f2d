"""Machine profiles: steps/mm, speeds, travel and switches of a machine by readable names, as controller settings."""

from wificnc.profile.load import check_machine, find_machines, load_machine
from wificnc.profile.model import Machine

__all__ = ["Machine", "check_machine", "find_machines", "load_machine"]
