"""The spine: motion of vertebrae from the poses of their triads."""
