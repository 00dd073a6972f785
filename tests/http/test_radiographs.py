"""Radiographs over HTTP: nothing that names a person is stored, and landmarks are fitted to object space."""

import io
import json
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.radiographs import RadiographScene, digitized, radiograph_scene
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, random_scoliosis
from spinewatch.spine.orientation import tilts_of
from tests.backends import everything_stored
from tests.http.harness import Service, code_of, problem_of, wait_for
from tests.spinewatch.imaging.dicom_files import PATIENT, dicom
from tests.spinewatch.spine.radiograph_scenes import FILMS, HEIGHT_OFFSET_MM, LATERAL, PA, scene, to_document

RANDOM = np.random.default_rng(1)
GRAY = RANDOM.integers(0, 4000, (60, 40), dtype=np.uint16)
STORED = (
    "SELECT (SELECT count(*) FROM radiographs), (SELECT count(*) FROM images), (SELECT count(*) FROM events)"
)
NAMES = (PATIENT, "Mustermann", "Erika", "19980704", "Doe^Jane", "Waldklinik")


def png(pixels: np.ndarray = GRAY) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def post(service: Service, surgery: str, content: bytes, **fields: str) -> httpx.Response:
    form = {"view": "pa", "left_on": "left", **fields}
    if form["view"] == "lateral":
        del form["left_on"]
    return service.client.post(
        f"/v1/surgeries/{surgery}/radiographs", data=form, files={"image": ("Erika Mustermann.dcm", content)}
    )


def test_of_a_dicom_file_nothing_that_names_a_person_is_stored(idle: Service) -> None:
    surgery = idle.surgery()
    content = dicom(GRAY, BitsStored=12, HighBit=11)
    assert all(name.encode() in content for name in NAMES)
    answer = post(idle, surgery, content)
    assert answer.status_code == 201, answer.text
    radiograph = answer.json()
    assert radiograph["pixel_spacing_mm"] == [0.2, 0.18]
    assert radiograph["spacing_source"] == "pixel_spacing"
    assert radiograph["positive_on"] == "left"
    stored = everything_stored(idle.database_url)
    assert radiograph["id"].encode() in stored
    files = [path.read_bytes() for path in idle.log.parent.iterdir() if path.is_file()]
    for content in (stored, *files):  # the database, the queue, and the service's log
        assert [name for name in NAMES if name.encode() in content] == []
    assert not any(name in answer.text for name in NAMES)


def test_a_radiograph_comes_back_with_its_image(idle: Service) -> None:
    surgery = idle.surgery()
    answer = post(idle, surgery, png(), view="lateral", anterior_on="right", pixel_spacing_mm="0.2,0.143")
    made = answer.json()
    assert answer.status_code == 201, answer.text
    location = answer.headers["Location"]
    assert location == f"/v1/surgeries/{surgery}/radiographs/{made['id']}"
    assert idle.client.get(location).json() == made
    assert (made["view"], made["positive_on"], made["spacing_source"]) == ("lateral", "right", "given")
    image = idle.client.get(f"{location}/image")
    assert image.headers["content-type"] == "image/png"
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(image.content))), GRAY)
    assert image.headers["ETag"] == f'"{made["image"]["sha256"]}"'
    again = idle.client.get(f"{location}/image", headers={"If-None-Match": image.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")
    listing = idle.client.get(f"/v1/surgeries/{surgery}/radiographs").json()
    assert (listing["total"], listing["items"]) == (1, [made])
    assert idle.events(made["id"]) == ["http:radiograph:added"]


BAD: list[tuple[bytes, dict[str, str], str]] = [
    (dicom(GRAY, PixelSpacing=None), {}, "pixel-spacing-missing"),
    (png(), {}, "pixel-spacing-missing"),
    (dicom(GRAY)[:-100], {}, "invalid-dicom"),
    (dicom(GRAY)[:400], {}, "invalid-dicom"),
    (bytes(128) + b"DICM", {}, "dicom-compressed"),
    (dicom(GRAY, NumberOfFrames="3"), {}, "invalid-dicom"),
    (dicom(GRAY, Rows=65535, Columns=65535), {}, "invalid-dicom"),
    (dicom(GRAY, PhotometricInterpretation="RGB"), {}, "invalid-dicom"),
    (dicom(GRAY, BurnedInAnnotation="YES"), {}, "dicom-annotated"),
    (b"text", {"pixel_spacing_mm": "0.1,0.1"}, "invalid-image"),
    (b"", {"pixel_spacing_mm": "0.1,0.1"}, "invalid-image"),
    (png(), {"pixel_spacing_mm": "0,0"}, "invalid-request"),
    (png(), {"pixel_spacing_mm": "0.1"}, "invalid-request"),
    (png(), {"pixel_spacing_mm": "0.1,0.1", "view": "lateral"}, "invalid-request"),
    (png(), {"pixel_spacing_mm": "0.1,0.1", "view": "oblique"}, "invalid-request"),
    (png(), {"pixel_spacing_mm": "0.1,0.1", "anterior_on": "left"}, "invalid-request"),
    (png(), {"pixel_spacing_mm": "0.1,0.1", "patient": "x"}, "invalid-request"),
]


@pytest.mark.parametrize(("content", "fields", "code"), BAD, ids=range(len(BAD)))
def test_a_bad_upload_is_a_named_problem_and_leaves_nothing(
    idle: Service, content: bytes, fields: dict[str, str], code: str
) -> None:
    surgery = idle.surgery()
    before = idle.sql(STORED)
    assert code_of(post(idle, surgery, content, **fields), 422) == code
    assert idle.sql(STORED) == before


def test_what_does_not_exist_is_not_found(idle: Service) -> None:
    surgery, other = idle.surgery(), idle.surgery()
    identifier = post(idle, surgery, dicom(GRAY)).json()["id"]
    get = idle.client.get
    assert code_of(post(idle, "none", dicom(GRAY)), 404) == "surgery-not-found"
    assert code_of(get("/v1/surgeries/none/radiographs"), 404) == "surgery-not-found"
    for path in ("", "/image"):
        for wrong in (f"{surgery}/radiographs/none", f"{other}/radiographs/{identifier}"):
            assert code_of(get(f"/v1/surgeries/{wrong}{path}"), 404) == "radiograph-not-found"


def test_a_body_that_is_no_form_is_refused(idle: Service) -> None:
    answer = idle.client.post(f"/v1/surgeries/{idle.surgery()}/radiographs", json={})
    assert code_of(answer, 415) == "unsupported-media-type"


def views(service: Service, surgery: str) -> tuple[str, str]:
    """Upload radiographs with the spacings of the scene."""

    def spacing(pair: tuple[float, float]) -> str:
        return f"{pair[0]},{pair[1]}"

    pa = post(service, surgery, png(), pixel_spacing_mm=spacing(PA.pixel_spacing_mm), left_on=PA.positive_on)
    lateral = post(
        service,
        surgery,
        png(),
        view="lateral",
        anterior_on=LATERAL.positive_on,
        pixel_spacing_mm=spacing(LATERAL.pixel_spacing_mm),
    )
    return pa.json()["id"], lateral.json()["id"]


def fit(service: Service, surgery: str, initial: dict[str, Any], stage: str | None = None) -> httpx.Response:
    return service.client.post(
        f"/v1/surgeries/{surgery}/radiographs/fit", json={"initial": initial, "stage": stage}
    )


@pytest.fixture(scope="module")
def exact() -> RadiographScene:
    return scene(11)


def test_a_fit_is_shown_and_nothing_is_stored(idle: Service, exact: RadiographScene) -> None:
    surgery = idle.surgery()
    document = to_document(exact, *views(idle, surgery))
    before = idle.sql(STORED)
    answer = fit(idle, surgery, document)
    assert answer.status_code == 200, answer.text
    shown = answer.json()
    assert shown["scale"] == pytest.approx(1, abs=0.01)
    assert shown["height_offset_mm"] == pytest.approx(HEIGHT_OFFSET_MM, abs=1e-6)
    assert shown["rms_mm"] < 1
    assert len(shown["residuals"]) == len(exact.common)
    assert shown["flags"] == []
    assert idle.sql(STORED) == before


def test_a_doubtful_landmark_is_named(idle: Service, exact: RadiographScene) -> None:
    surgery = idle.surgery()
    document = json.loads(json.dumps(to_document(exact, *views(idle, surgery))))
    document["common"][4]["object_mm"][0] += 12.0
    shown = fit(idle, surgery, document).json()
    assert "radiograph-point-doubtful" in [flag["code"] for flag in shown["flags"]]
    assert [point["name"] for point in shown["residuals"] if point["doubtful"]] == ["screw 5"]


def test_bad_landmarks_are_named_problems(idle: Service, exact: RadiographScene) -> None:
    surgery, other = idle.surgery(), idle.surgery()
    pa, lateral = views(idle, surgery)
    good = to_document(exact, pa, lateral)

    def problem(change: Any, status: int = 422) -> str:
        document = json.loads(json.dumps(good))
        change(document)
        return code_of(fit(idle, surgery, document), status)

    def scaled(document: dict[str, Any]) -> None:
        for landmark in document["common"]:
            landmark["object_mm"] = [1.06 * value for value in landmark["object_mm"]]

    def together(document: dict[str, Any]) -> None:
        for landmark in document["common"]:
            landmark.update({key: document["common"][0][key] for key in ("pa", "lateral", "object_mm")})

    assert problem(lambda d: d.update(pa=lateral)) == "unknown-radiograph"
    assert problem(lambda d: d.update(lateral="none")) == "unknown-radiograph"
    assert problem(scaled) == "radiograph-scale-implausible"
    assert problem(together) == "common-points-undetermined"
    assert problem(lambda d: d.update(common=d["common"][:2])) == "invalid-request"
    assert problem(lambda d: d["vertebrae"][1].update(vertebra="T1")) == "radiograph-landmarks"
    assert problem(lambda d: d["vertebrae"][1].update(vertebra="T99")) == "invalid-levels"
    assert problem(lambda d: d["vertebrae"].reverse() or d["vertebrae"][0].update(vertebra="T1")) in {
        "radiograph-landmarks"
    }
    assert code_of(fit(idle, other, good), 422) == "unknown-radiograph"
    assert code_of(fit(idle, "none", good), 404) == "surgery-not-found"
    assert code_of(fit(idle, surgery, good, "PRE"), 404) == "stage-not-found"


def test_triads_that_no_stage_was_named_for_are_left_out(idle: Service, exact: RadiographScene) -> None:
    surgery = idle.surgery()
    document = json.loads(json.dumps(to_document(exact, *views(idle, surgery))))
    document["common"][0].update(object_mm=None, triad="L1")
    shown = fit(idle, surgery, document).json()
    assert shown["left_out"] == ["screw 1"]
    for landmark in document["common"]:
        landmark.update(object_mm=None, triad="L1")
    detail = problem_of(fit(idle, surgery, document), 422)["detail"]
    assert "0 common points" in detail


PRONE = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
"""Object axes of a prone patient with the head along X: columns are anterior, left and cephalad."""


def test_a_spine_starts_from_its_radiographs(service: Service, measured: str) -> None:
    """Landmarks on a simulated pair, three of them the triads of the sample surgery, give the spine of its stages."""
    triads = service.client.get(f"/v1/surgeries/{measured}/stages/PRE/triads").json()["triads"]
    place = {triad["label"]: np.array(triad["position_mm"]) for triad in triads if triad["label"]}
    rng = np.random.default_rng(3)
    poses = random_scoliosis(rng, CurveKind.DOUBLE).poses
    patient = RigidTransform(PRONE, np.mean(list(place.values()), axis=0))
    scene = radiograph_scene(LEVELS, poses.position_mm, poses.rotation, patient, rng, FILMS)
    initial = to_document(digitized(scene, 2.0, rng), *views(service, measured))
    for landmark, vertebra in zip(initial["common"], ("T7", "T9", "L1"), strict=False):
        point = patient.inverse()(place[vertebra][None])[0]
        landmark.update(
            pa=FILMS.pa_px(point).tolist(),
            lateral=FILMS.lateral_px(point).tolist(),
            object_mm=None,
            triad=vertebra,
        )
    shown = fit(service, measured, initial, "PRE").json()
    assert shown["left_out"] == []
    assert shown["scale"] == pytest.approx(1, abs=4 * shown["scale_sd"])
    axes = {"kind": "directions", "cephalad": "+x", "left": "+y"}
    setup = {"patient_axes": axes, "baseline": "PRE", "initial": initial}
    answer = service.client.put(f"/v1/surgeries/{measured}/spine", json=setup)
    assert answer.status_code == 200, answer.text

    def computed() -> dict[str, Any] | None:
        answer = service.client.get(f"/v1/surgeries/{measured}/stages/PRE/spine")
        return dict(answer.json()) if answer.status_code == 200 else None

    found = wait_for(computed, "the spine of PRE")
    tilts = tilts_of(poses.rotation)
    for vertebra in found["vertebrae"]:
        if vertebra["coronal_tilt_deg"] is None:
            continue
        true = [float(tilt[LEVELS.index(vertebra["vertebra"])]) for tilt in tilts]
        for name, value in zip(("coronal_tilt", "sagittal_tilt", "axial_rotation"), true, strict=True):
            error = vertebra[f"{name}_deg"] - value
            assert abs(error) < 4.5 * vertebra[f"{name}_sd_deg"], (vertebra["vertebra"], name)
    assert {vertebra["vertebra"] for vertebra in found["vertebrae"]} >= set(place)
