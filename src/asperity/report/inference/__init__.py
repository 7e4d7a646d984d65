"""Report of the inference of a contact's state from recordings."""
