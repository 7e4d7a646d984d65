"""Output of `asperity track` and `watch`, and tables of overall values (`series`).

The commands and their options are in `cli.track_watch`.
"""
