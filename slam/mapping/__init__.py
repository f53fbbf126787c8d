"""From matched scans to maps."""
