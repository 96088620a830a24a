"""A run of a study: pending blocks to threads or dask, results to the store as they finish, by a single writer."""
