"""Pictures of balls with truth: worlds drawn at random, traced for one bounce, and taken by a sensor."""
