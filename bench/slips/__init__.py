"""Slips between the cart and the record: how each is made from sound input, and what its right answer is."""
