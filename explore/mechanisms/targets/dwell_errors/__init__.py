"""How long the output of a mechanism rests, or how far it moves meanwhile: a dwell over its input angle."""
