"""How well the output of a mechanism follows a function of its input: errors of its angle at given pairs."""
