"""The flight recorder: the last minute of frames of a bus, as a pcapng file."""
