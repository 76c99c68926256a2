"""Stations of a segment in the host process: search, EEPROM, firmware, examination."""
