"""How well a point of a floating link follows a path: distances of given points to its curve, in their order."""
