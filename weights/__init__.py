"""Pre-trained weights as files, and the ones that are shipped (Sec. 3.1.4)."""
