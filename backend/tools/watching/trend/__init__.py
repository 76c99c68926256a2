"""Condition of axes over years: signed baselines, health checks, comparison and trend."""
