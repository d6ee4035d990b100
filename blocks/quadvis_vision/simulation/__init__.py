"""Pictures of a scene that exists in numbers only, and the faults of real pictures."""
