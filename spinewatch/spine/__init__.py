"""From triad poses to the motion and configuration of the spine."""
