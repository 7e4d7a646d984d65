"""The page of a wear history."""
