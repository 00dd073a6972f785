"""Ball candidates by template correlation (DETECT-POINT, thesis chapter 4)."""
