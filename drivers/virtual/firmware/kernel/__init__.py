"""The 50 µs loop of one virtual drive: demand, control, plant, supply, measurement, protections."""
