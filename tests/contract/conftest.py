import pytest

from spinewatch.calibration.files import ShotFiles, calibrate_files, load_control_field
from spinewatch.calibration.from_images import CalibrationResult
from tests.paths import SAMPLES

BOARDS = SAMPLES / "calibration" / "C1"


@pytest.fixture(scope="session")
def calibrated() -> CalibrationResult:
    """A calibration from one shot of the samples, and another shot held out."""
    shots = [
        ShotFiles(name, *((BOARDS / name / f"{side}.png").read_bytes() for side in ("left", "right")))
        for name in ("C", "A")
    ]
    return calibrate_files(shots, load_control_field("pegboard-1995"), verify=1)
