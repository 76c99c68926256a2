"""Hold-to-run jog, on cyclic buses and by a moving profile-position target."""
