"""Ranking: the Pareto fronts of the feasible designs, and measures to choose among the designs of a front."""
