"""Any number of calibrated cameras: ``{"cameras": [{"name": ..., and a camera as in a rig}]}``."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Len
from pydantic import Field

from contract.base import Known3, Number, Schema, plain
from contract.calibration import CameraQuality
from contract.flag import Flag
from contract.rig import Camera
from spinewatch.calibration.cameras import CalibratedCameras
from spinewatch.calibration.quality.accuracy import ShotAccuracy


class _Named(Schema):
    name: Annotated[str, Field(description="Name of the camera.")]


class NamedCamera(Camera, _Named):
    """One calibrated camera and its name."""


class PairShot(Schema):
    """The control points of one shot, reconstructed by two cameras."""

    name: Annotated[str, Field(description="Name of the shot.")]
    reconstructed: Annotated[int, Field(description="Number of points.")]
    sd_mm: Annotated[Known3, Field(description="Standard deviation of residuals in X, Y, Z.")]

    @classmethod
    def of(cls, accuracy: ShotAccuracy) -> PairShot:
        """Return the contract model of the library's residuals."""
        return cls(name=accuracy.name, reconstructed=len(accuracy.ids), sd_mm=plain(accuracy.sd_mm))


class CameraPair(Schema):
    """The control points reconstructed by two cameras."""

    cameras: Annotated[list[str], Len(2, 2), Field(description="Names of the two cameras.")]
    shots: Annotated[list[PairShot], Field(description="Every shot that both cameras show.")]


class RemovedCameraPoint(Schema):
    """An image point of one camera that contradicts the others."""

    camera: Annotated[str, Field(description="Name of the camera.")]
    shot: Annotated[str, Field(description="Name of the shot.")]
    id: Annotated[str, Field(description="Identifier of the control point.")]
    residual_px: Annotated[Number, Field(description="Distance from where the others expect it, px.")]


class CamerasResult(Schema):
    """Calibrated cameras and how well they are determined."""

    cameras: Annotated[list[NamedCamera], Field(description="The calibrated cameras.")]
    shots: Annotated[list[str], Field(description="Names of the shots.")]
    quality: Annotated[dict[str, CameraQuality], Field(description="Accuracy of each camera's parameters.")]
    pairs: Annotated[list[CameraPair], Field(description="Every pair of cameras that shows the same points.")]
    removed: Annotated[list[RemovedCameraPoint], Field(description="Image points removed as blunders.")]
    flags: Annotated[list[Flag], Field(description="Doubts about the calibration.")]
    version: Annotated[str, Field(description="Version of Spinewatch.")]

    @classmethod
    def of(cls, result: CalibratedCameras, version: str) -> CamerasResult:
        """Return the contract model of the library's cameras; numbers that are not determined are null."""
        names = tuple(result.cameras)
        return cls(
            cameras=[
                NamedCamera(name=name, **dict(Camera.model_validate(camera)))
                for name, camera in result.cameras.items()
            ],
            shots=list(result.shots),
            quality={name: _quality(result, c, name) for c, name in enumerate(names)},
            pairs=[
                CameraPair(cameras=list(pair), shots=[PairShot.of(accuracy) for accuracy in found])
                for pair, found in result.pairs.items()
            ],
            removed=[
                RemovedCameraPoint(
                    camera=names[b.camera], shot=result.shots[b.shot], id=b.id, residual_px=b.residual_px
                )
                for b in result.blunders
            ],
            flags=Flag.of(result.flags),
            version=version,
        )


def _quality(result: CalibratedCameras, c: int, name: str) -> CameraQuality:
    adjustment = result.adjustment
    return CameraQuality(
        free=list(adjustment.block.free[c]),
        sd=dict(result.sd(name)),
        sd_limits={},
        image_rms_px=adjustment.camera_rms_px(c),
        points=sum(len(r) for (camera, _), r in adjustment.residuals_px.items() if camera == c),
    )
