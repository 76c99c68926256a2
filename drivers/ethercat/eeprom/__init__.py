"""The EEPROM of a slave as a whole: read, check, compare, plan a change, write and read back."""
