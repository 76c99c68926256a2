"""Routes of measurements, notches, gains, design and the automatic tuning."""
