"""Names as users write them become objects here, and nowhere below."""
