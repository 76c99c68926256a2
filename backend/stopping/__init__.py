"""STOP until standstill: the quick stop, the watch over the measured speed, and what follows."""
