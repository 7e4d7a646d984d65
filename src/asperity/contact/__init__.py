"""Operating conditions of the contact, named materials, Hertz theory, roller shapes, the grid."""
