"""Compute designs: in blocks, on threads, processes or a cluster, and one design over a turn."""
