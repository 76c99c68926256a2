"""Motion and measurement tools; each runs as a job that can be cancelled."""
