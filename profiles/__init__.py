"""What a drive is: its parameters, faults, procedures and peculiarities, as data."""

from profiles.loader import drive_names, load_all, load_profile
from profiles.schema import Parameter, Profile

__all__ = ["Parameter", "Profile", "drive_names", "load_all", "load_profile"]
