"""Training of the ball networks with simulated examples; the only package that needs PyTorch."""
