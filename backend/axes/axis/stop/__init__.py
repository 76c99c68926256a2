"""The quick stop of one axis: settings, deceleration, and braking where it would coast."""
