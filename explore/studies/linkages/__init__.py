"""Read tables of planar linkages from the section [linkage] of a study or of a file of its own."""
