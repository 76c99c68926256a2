"""How many may be there at once, so that nobody's crowd keeps STOP or another person out."""
