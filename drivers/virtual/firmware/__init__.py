"""Firmware of virtual drives: dictionary, CiA 402, modes, protections and the 50 µs loop."""

from drivers.virtual.firmware.factory import make_device
from drivers.virtual.firmware.servo import VirtualServo

__all__ = ["VirtualServo", "make_device"]
