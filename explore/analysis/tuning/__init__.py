"""Control curves: a metric of one design over one of its parameters, and where the metric is within a range."""
