"""The crank-rocker: declaration and kernel."""
