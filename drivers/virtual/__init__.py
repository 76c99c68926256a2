"""Simulated drives on real wires: firmware, mechanics, and the bytes of each bus."""
