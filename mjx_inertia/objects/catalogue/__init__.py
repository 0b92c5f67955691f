"""The catalogue: 70 objects in five categories, each made on demand from its parameters."""
