"""The method of the 1995 thesis as published."""
