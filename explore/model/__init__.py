"""Frozen data of the field: declarations of mechanisms, requests, columns of results, status codes."""
