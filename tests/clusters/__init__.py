"""Sweeps on real clusters of real processes, which are killed, interrupted, poisoned and mismatched."""
