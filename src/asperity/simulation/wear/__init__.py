"""Wear of a contact over hours, jump by jump."""
