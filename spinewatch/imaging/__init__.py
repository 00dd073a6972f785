"""Images: frames, decoding, exposure, tone and pyramids."""
