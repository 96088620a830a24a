"""Quadrature over windows of the motion: rules, panels, the compiled loop that samples, moments and extremes."""
