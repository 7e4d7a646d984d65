"""The contact that is posed: operating conditions, Hertz theory, roller shapes, the grid."""
