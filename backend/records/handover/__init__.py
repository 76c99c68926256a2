"""Hand-over of tuned values to a machine's controller, and comparison with its own list."""
