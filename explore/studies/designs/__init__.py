"""The designs of a study: grids, samples, tables, solved lengths; any block from its number."""
