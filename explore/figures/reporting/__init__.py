"""The interactive report: a results file as one page that works from disk."""
