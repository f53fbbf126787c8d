"""The source documents' experiments, one file each: record once, driven by truth, and run every method on that recording."""
