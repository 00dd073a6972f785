"""Camera parameters from image points: DLT, resection, bundle adjustment, blunder detection."""
