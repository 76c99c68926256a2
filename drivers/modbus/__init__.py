"""Modbus RTU: framing, and a Link over register tables."""
