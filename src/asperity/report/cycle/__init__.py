"""Report of a contact over a cycle of load and speeds."""
