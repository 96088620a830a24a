"""Ways to solve the motion of a four-bar linkage, side by side, to compare what they cost and where they fail."""
