"""Designs from the measured plant, and the gains and notches of a drive that realise them."""
