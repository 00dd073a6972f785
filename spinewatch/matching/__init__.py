"""MATCH-POINT's lower levels: from features in two views to points in space."""
