"""Firmware of virtual drives: dictionary, CiA 402 and one strategy per family."""
