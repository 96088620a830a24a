"""Errors of mechanisms that follow a target: a path, poses of a body, a function."""
