"""Report of a simulated history of a contact in motion."""
