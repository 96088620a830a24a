"""Charts of results, whose public names are in `explore.charts`, and of comparisons."""
