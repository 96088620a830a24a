"""A service: studies wait in a folder, are swept one after the other, and their results are read over HTTP."""
