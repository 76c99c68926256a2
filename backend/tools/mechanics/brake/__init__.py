"""Brake test: a torque ramp against the closed holding brake, both directions."""
