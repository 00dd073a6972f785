"""Predicted accuracy of a rig, a marker or a control field."""
