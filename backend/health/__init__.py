"""The condition of axes over years: signed baselines, health checks, their comparison and trend."""
