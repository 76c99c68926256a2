"""STOP out of every kind of motion, judged by the shaft: ``python -m benchmarks.stopping``."""
