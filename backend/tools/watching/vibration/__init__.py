"""Vibration over speed: orders, frequencies, and the resonances that orders excite."""
