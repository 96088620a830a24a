"""Error and cost of the ways to solve and to average a motion, against an exact reference."""
