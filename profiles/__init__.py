"""What a drive is: its parameters, faults, procedures and peculiarities, as data."""

from profiles.loader import STANDARD, drive_names, load_all, load_profile
from profiles.schema import Parameter, Profile

__all__ = ["STANDARD", "Parameter", "Profile", "drive_names", "load_all", "load_profile"]
