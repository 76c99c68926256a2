"""What a master reads and writes: the dictionary, process data, registers and their storage."""
