"""Studies from TOML files, with all errors at once."""
