"""Global sensitivity: apportion the variance of feasibility and of metrics to the parameters of a study."""
