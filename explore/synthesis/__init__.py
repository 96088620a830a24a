"""Synthesis: linkages for a task, such as a path, poses, a function, or a swing with a time ratio."""
