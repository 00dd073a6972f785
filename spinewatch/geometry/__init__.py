"""Rotations, rigid and similarity transforms, rays, triangulation and pinhole projection."""
