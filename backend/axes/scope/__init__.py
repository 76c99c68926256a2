"""Scope: delivery of samples, units of traces, stored set-ups and snapshots."""
