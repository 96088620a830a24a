"""A results file: created complete, written block by block, read while it grows."""
