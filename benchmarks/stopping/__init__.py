"""STOP out of every kind of motion, judged by the virtual shaft: ``python -m benchmarks.stopping``."""
