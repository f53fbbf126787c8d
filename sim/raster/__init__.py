"""The twin's own renderer: a z-buffer over planar faces, drawn straight into the distorted, rolling picture."""
