"""STOP until standstill: the watch over the measured speed, and what follows a quick stop."""
