"""The whole EEPROM of a slave: read, check, compare, plan a change, write and read back."""
