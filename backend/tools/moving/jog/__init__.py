"""Hold-to-run jog: on cyclic buses, and by a moving target in profile position mode."""
