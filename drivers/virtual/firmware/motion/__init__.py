"""What moves the axis: modes, generators, homing, jog, identification, stops, brake, gantry."""
