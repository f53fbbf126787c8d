"""What `twin print` prints, one file each."""
