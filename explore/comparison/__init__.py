"""Cost against error, and where methods fail."""
