"""Hand-over of tuned values to a machine controller, and what its own list would write."""
