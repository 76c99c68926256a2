"""Motion and measurement tools; each is a cancellable job."""
