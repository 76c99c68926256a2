"""The host process of one segment: its operations, and how the server starts and calls it."""

from drivers.computer.network.packet_capture import find_library

# Before any module of this package imports SOEM, whose library needs those of Npcap on Windows.
find_library()
