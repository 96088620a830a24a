"""What every room stands on: errors, files, text, units, compiling and arithmetic in lanes."""
