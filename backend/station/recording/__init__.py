"""Recording of a running station: the recorder, the capture of faults, the live feed."""
