"""Several pipelines on the same frames."""
