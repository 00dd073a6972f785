"""Readers and writers of every rig file format."""
