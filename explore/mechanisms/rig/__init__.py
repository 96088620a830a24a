"""The oscillating-torque test rig: declaration, kernel, forces, derived metrics."""
