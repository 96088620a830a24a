"""Evaluation of designs: closed form, screening, sampling, scaling with the speed, derived metrics."""
