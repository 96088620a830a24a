"""Kills, power cuts, disk errors, full disks and rivals, against the real store."""
