"""The commands, one module each: its arguments and options, and what it does."""
