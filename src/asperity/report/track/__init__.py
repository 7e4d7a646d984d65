"""The page of a tracked series and its exhibits."""
