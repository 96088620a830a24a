"""The mechanisms, one package each, the compiled functions that they share, and the registry."""
