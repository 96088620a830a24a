"""Pictures of results; each function returns a matplotlib Figure."""
