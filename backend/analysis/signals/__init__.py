"""Excitation signals, spectra and steps."""
