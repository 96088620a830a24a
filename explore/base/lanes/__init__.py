"""Compiled functions that work on many designs or nodes at once, one in each lane of a tile."""
