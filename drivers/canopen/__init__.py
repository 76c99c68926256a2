"""CANopen, with the libraries python-can and canopen."""
