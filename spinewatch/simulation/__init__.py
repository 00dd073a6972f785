"""Truth for tests, planning and demonstrations: rigs, spines with triads, and what cameras see of them."""
