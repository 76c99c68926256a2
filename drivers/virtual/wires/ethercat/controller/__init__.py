"""The slave controller: registers, process memory, states, clocks and EEPROM."""
