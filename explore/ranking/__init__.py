"""Ranking: which designs no other design beats in every objective, and what is left to choose among them."""
