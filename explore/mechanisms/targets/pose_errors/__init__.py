"""How well the floating link carries a body through poses: errors of place and angle at the best crank angles."""
