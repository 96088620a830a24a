"""The real store under kills, power cuts, disk errors, full disks and concurrent writers."""
