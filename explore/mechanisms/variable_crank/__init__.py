"""The slider-crank with a variable crank length: declaration and kernel."""
