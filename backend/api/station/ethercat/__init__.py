"""Survey, aliases, firmware and EEPROM of EtherCAT segments: routes and models."""
