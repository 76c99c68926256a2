"""Routes of axis condition: baselines, comparison, trend."""
