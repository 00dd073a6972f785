"""The programs of the 1995 thesis by their names: pix2mm, ndlt, v2stereo, sim3d, detect, match and spaco."""
