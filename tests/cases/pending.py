"""Cases without their right answer, with the verdict on today's; a case that turns right must be removed here."""

PENDING: dict[str, str] = {}
