"""Units of measure: numbers that are written with one, and units in which values are shown."""
