"""Studies, from Python and from TOML files; all problems are reported at once."""
