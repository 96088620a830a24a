"""Planar linkages that a user describes by a table: its data, the order in which they are solved, their mechanism."""
