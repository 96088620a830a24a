"""Four-bars whose coupler point passes many points: an atlas of paths, alignment, and least squares that keep the
order.
"""
