"""Common parts of CiA 402 families: interface, gains, notches, terminals, protections."""
