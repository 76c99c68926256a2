"""Frequency response of an axis: plan, excitation, evaluation."""
