"""Sweeps on real clusters whose processes are killed, stopped, interrupted, or have other versions."""
