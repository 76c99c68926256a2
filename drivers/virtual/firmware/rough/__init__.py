"""The non-ideal drive: how it reports its motion, and the options of its torque."""
