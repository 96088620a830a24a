"""A run of a study: pending blocks to dask, results to the store as they finish. The client is the only writer."""
