"""Plans: the accuracy that is expected of a rig and a marker, and the disparities of a rig."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from contract.base import Known, Known2, Known3, Number, Plain, Schema, Vector2, Vector3
from spinewatch.camera import Rig

if TYPE_CHECKING:
    import spinewatch.planning.plan
    from spinewatch.planning.accuracy import TriadAccuracy
    from spinewatch.planning.depth_range import DepthAccuracy
    from spinewatch.planning.disparity import DisparityGrid


class RigPlan(Schema):
    """Geometry of the rig."""

    name: Annotated[str, Field(description="Name of the calibration, or `planned`.")]
    baseline_mm: Annotated[Number, Field(description="Distance between the cameras, mm.")]
    vergence_deg: Annotated[Number, Field(description="Angle between the optical axes, degrees.")]
    height_mm: Annotated[
        Number, Field(description="Height of the cameras above the point in which their axes meet, mm.")
    ]
    focal_length_mm: Annotated[Number, Field(description="Focal length of the left camera, mm.")]
    image_size_px: Annotated[list[int], Plain, Field(description="Width and height of the left image, px.")]
    pixel_size_mm: Annotated[Vector2, Field(description="Width and height of a pixel on the plate, mm.")]
    pixel_mm: Annotated[Number, Field(description="Width of a pixel at the point where the axes meet, mm.")]


class MarkerPlan(Schema):
    """The marker, and how well its balls are told apart."""

    name: Annotated[str, Field(description="Name of the marker.")]
    balls: Annotated[list[str], Plain, Field(description="Names of the balls.")]
    coordinates_mm: Annotated[
        list[Vector3], Plain, Field(description="Their centres in the marker's frame, origin P, mm.")
    ]
    distances_mm: Annotated[
        list[float], Plain, Field(description="Distances of balls 1 and 2, 1 and 3, 2 and 3, mm.")
    ]
    ball_diameter_mm: Annotated[Number, Field(description="Diameter of the balls, mm.")]
    ball_px: Annotated[
        Number, Field(description="Diameter of a ball in the image, in widths of a pixel, px.")
    ]
    difference_mm: Annotated[
        Known, Field(description="Smallest difference between two of the distances, mm.")
    ]
    difference_sd_mm: Annotated[
        Known, Field(description="Largest standard deviation with which that difference is measured, mm.")
    ]
    neighbour_mm: Annotated[
        Known,
        Field(
            description="Largest distance error of the best wrong triplet, with balls of two vertebrae, mm; null with"
            " one vertebra."
        ),
    ]


class TriadPlan(Schema):
    """Expected standard deviations of one vertebra's triad."""

    vertebra: Annotated[str, Field(description="Name of the vertebra.")]
    position_sd_mm: Annotated[Known3, Field(description="Of P, along the object axes, mm.")]
    in_plane_sd_deg: Annotated[Known, Field(description="Of the rotation about the triad's normal, degrees.")]
    out_of_plane_sd_deg: Annotated[
        Known, Field(description="Of the rotations about the triad's x and y, the larger one, degrees.")
    ]
    motion_sd_mm: Annotated[
        Known3, Field(description="Of the displacement between two stages, mm; null for the reference.")
    ]
    motion_sd_deg: Annotated[
        Known3,
        Field(description="Of the rotation vector between two stages, degrees; null for the reference."),
    ]
    in_view: Annotated[bool, Field(description="Whether both images show all balls.")]

    @classmethod
    def of(cls, triad: TriadAccuracy) -> TriadPlan:
        """Return the contract model of the library's triad."""
        return cls.model_validate(triad)


class DepthPlan(Schema):
    """Expected standard deviations of a level triad at one height."""

    height_mm: Annotated[Number, Field(description="Height above the point where the optical axes meet, mm.")]
    position_sd_mm: Annotated[Known3, Field(description="Of P, along the object axes, mm.")]
    rotation_sd_deg: Annotated[
        Known3, Field(description="Of the rotation about the triad's x, y and z, degrees.")
    ]
    largest_sd_mm: Annotated[Known, Field(description="Of P in the direction in which it is largest, mm.")]
    largest_direction: Annotated[
        Known3, Field(description="That direction, unit vector with z upwards, object axes.")
    ]
    pixel_mm: Annotated[Number, Field(description="Width of a pixel at this height, mm.")]
    in_view: Annotated[bool, Field(description="Whether both images show all balls.")]

    @classmethod
    def of(cls, depth: DepthAccuracy) -> DepthPlan:
        """Return the contract model of the library's accuracy at a height."""
        return cls.model_validate(depth)


class AccuracyPlan(Schema):
    """What is expected of a rig and a marker; nothing was measured."""

    frame: Annotated[str, Field(description="Axes of the standard deviations.")]
    rig: Annotated[RigPlan, Field(description="The rig that was planned with.")]
    marker: Annotated[MarkerPlan, Field(description="The marker, and how surely its balls are told apart.")]
    triads: Annotated[list[TriadPlan], Field(description="One per vertebra, the reference first.")]
    cobb_sd_deg: Annotated[
        Known,
        Field(description="Of the Cobb angle between the first and the last triad at one stage, degrees."),
    ]
    depths: Annotated[list[DepthPlan], Field(description="One triad at several heights, lowest first.")]

    @classmethod
    def of(cls, plan: spinewatch.planning.plan.Plan, rig: Rig, frame: str) -> AccuracyPlan:
        """Return the contract model of the library's plan."""
        model, ambiguity = plan.accuracy.model, plan.ambiguity
        return cls(
            frame=frame,
            rig=RigPlan(
                name=rig.name,
                baseline_mm=rig.baseline_mm,
                vergence_deg=rig.vergence_deg,
                height_mm=plan.height_mm,
                focal_length_mm=rig.left.focal_length_mm,
                image_size_px=list(rig.left.image_size_px),
                pixel_size_mm=list(rig.left.pixel_size_mm),
                pixel_mm=plan.pixel_mm,
            ),
            marker=MarkerPlan.model_validate(
                {
                    "name": model.name,
                    "balls": model.balls,
                    "coordinates_mm": model.coordinates_mm,
                    "distances_mm": model.distances_mm,
                    "ball_diameter_mm": model.ball_diameter_mm,
                    "ball_px": model.ball_diameter_mm / plan.pixel_mm,
                    "difference_mm": None if ambiguity is None else ambiguity.difference_mm,
                    "difference_sd_mm": None if ambiguity is None else ambiguity.difference_sd_mm,
                    "neighbour_mm": None if ambiguity is None else ambiguity.neighbour_mm,
                }
            ),
            triads=[TriadPlan.of(triad) for triad in plan.accuracy.triads],
            cobb_sd_deg=plan.accuracy.cobb_sd_deg,
            depths=[DepthPlan.of(depth) for depth in plan.depths],
        )


class DisparityPlane(Schema):
    """Disparities of the points of a plane that both images show."""

    height_mm: Annotated[Number, Field(description="Height above the point where the optical axes meet, mm.")]
    mean_px: Annotated[Known2, Field(description="Mean disparity (u, v), right minus left, px.")]
    sd_px: Annotated[Known2, Field(description="Standard deviation over the field of view (u, v), px.")]
    shown: Annotated[
        Number, Field(description="Fraction of the left image whose points the right image shows too.")
    ]


class DisparityPlan(Schema):
    """Disparities of a rig over its field of view and depth."""

    rig: Annotated[str, Field(description="Name of the calibration, or `planned`.")]
    planes: Annotated[list[DisparityPlane], Field(description="Planes of constant height, lowest first.")]
    u_px: Annotated[Vector2, Field(description="Smallest and largest disparity along u, px.")]
    v_px: Annotated[Vector2, Field(description="Smallest and largest disparity along v, px.")]

    @classmethod
    def of(cls, grid: DisparityGrid, rig: str, middle_z_mm: float) -> DisparityPlan:
        """Return the contract model of the library's grid; heights are from the point where the axes meet."""
        mean, sd = grid.distribution()
        shown = 1 - (grid.disparity_px[..., 0] != grid.disparity_px[..., 0]).mean(axis=(1, 2))
        u, v = grid.bounds_px()
        return cls.model_validate(
            {
                "rig": rig,
                "planes": [
                    {"height_mm": z - middle_z_mm, "mean_px": mean[i], "sd_px": sd[i], "shown": shown[i]}
                    for i, z in enumerate(grid.z_mm)
                ],
                "u_px": u,
                "v_px": v,
            }
        )
