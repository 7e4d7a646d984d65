"""The page of what recordings say of a contact."""
