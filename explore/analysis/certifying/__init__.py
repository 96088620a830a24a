"""Proofs of what results say of designs, in ball arithmetic."""
