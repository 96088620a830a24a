"""Tolerances of designs: derivatives, worst cases, spreads, and probabilities of missing a constraint."""
