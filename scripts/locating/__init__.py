"""What `twin locate` is made of."""
