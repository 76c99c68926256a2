"""Benchmarks compared with their peers; ``make bench`` runs them all."""
