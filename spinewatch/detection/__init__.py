"""Detection of balls: from an image to features with sub-pixel centres."""
