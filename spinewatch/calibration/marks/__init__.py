"""Targets of a control field in an image: detection, identification, eccentricity."""
