"""A pair of non-circular gears with an exponential working sector, also as trains of a stepless drive."""
