"""Scan matchers: points and a guess in, a `Match` out. Matchers do not know each other."""
