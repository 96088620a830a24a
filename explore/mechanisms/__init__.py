"""The mechanisms: one module each, and the registry."""
