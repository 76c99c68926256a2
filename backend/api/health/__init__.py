"""Routes of the axes' condition: baselines, comparison, trend."""
