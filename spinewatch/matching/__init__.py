"""Correspondence (MATCH-POINT's lower levels): from features of two images to points and candidate triads."""
