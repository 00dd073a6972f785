"""Multipart forms and the checks that need no decoding."""
