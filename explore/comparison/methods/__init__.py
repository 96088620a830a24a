"""Methods to solve the motion of a four-bar linkage, for comparison of their cost and failures."""
