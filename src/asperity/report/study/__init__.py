"""Report of a study, with figures and tables for a paper."""
