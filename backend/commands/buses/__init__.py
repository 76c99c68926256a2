"""Commands about a bus: search, doctor, conformance, EEPROM, LSS, a virtual drive."""
