"""How the ball network came about: simulated examples in, weights out. Needs PyTorch; nothing else does."""
