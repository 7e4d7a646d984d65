"""Watch of one folder: its state, and its updates as recordings arrive."""
