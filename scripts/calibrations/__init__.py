"""What `twin calibrate` measures, one file each."""
