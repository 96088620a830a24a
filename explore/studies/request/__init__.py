"""Resolve the names and units that users write; the packages below take objects and numbers."""
