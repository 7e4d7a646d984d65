"""The page of a history and its exhibits."""
