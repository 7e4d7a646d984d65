"""Output fitted to the terminal: commands grouped by task, lines within its width."""
