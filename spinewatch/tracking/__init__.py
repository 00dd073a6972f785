"""Tracking: a moving spine in a burst of stereo pairs, and breathing."""
