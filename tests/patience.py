"""How long tests wait for what must happen: far longer than it takes, so that nothing depends on a busy machine."""

import os

PATIENCE_S = 240.0


def machine_is_quiet() -> bool:
    """Return whether no more processes want to run than there are cores: a promise of seconds can be checked."""
    return os.getloadavg()[0] <= (os.cpu_count() or 1)
