"""DETECT-POINT: from an image to ball features."""
