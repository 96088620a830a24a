"""What follows from results: refinement, tuning, tolerances, sensitivity, proofs, coverage."""
