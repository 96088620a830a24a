"""Tasks in files: what a linkage shall do, read and checked, and the solver that each type of task has."""
