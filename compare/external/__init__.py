"""Other programs on the same scenes."""
