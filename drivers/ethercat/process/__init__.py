"""The process of one segment: what it does, and how the server starts and asks it."""

from drivers.computer.packet_capture import find_library

# Before any module of this package imports SOEM, whose library needs those of Npcap on Windows.
find_library()
