"""The slider-crank: declaration and kernel."""
