"""Health check: repeated rounds of measurements that monitor the condition of an axis."""
