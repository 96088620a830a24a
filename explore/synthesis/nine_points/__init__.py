"""All four-bars whose coupler point passes nine points, by continuation from the solutions of a generic problem."""
