"""The page of a study, its exhibits, and its figures and tables for a paper."""
