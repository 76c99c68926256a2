"""CANopen over python-can and canopen."""
