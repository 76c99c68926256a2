"""The quick stop of one axis: its settings, how it is raised, what brakes where it would coast."""
