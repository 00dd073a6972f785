"""Candidate ball images by template correlation (DETECT-POINT, thesis chapter 4)."""
