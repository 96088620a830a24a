"""The public functions: they resolve names, call the packages below and return tables."""
