"""The catalogue: 57 objects in five categories, each made on demand from its parameters."""
