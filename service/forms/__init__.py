"""Multipart forms: their parts, and all checks that need no decoding of an image."""
