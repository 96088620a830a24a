"""Refine a Pareto front: draw designs around it, generation by generation."""
