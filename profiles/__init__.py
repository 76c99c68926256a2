"""Drive families as data: parameters, faults, procedures and peculiarities."""

from profiles.loader import STANDARD, drive_names, load_all, load_profile
from profiles.schema import Parameter, Profile

__all__ = ["STANDARD", "Parameter", "Profile", "drive_names", "load_all", "load_profile"]
