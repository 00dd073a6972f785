import json
from dataclasses import replace

import numpy as np

from spinewatch.detection.candidates.search import detect
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.thesis_1995.detection import THESIS_1995
from tests.paths import SAMPLES


def test_the_published_method_finds_most_balls_of_the_sample() -> None:
    folder = SAMPLES / "D1" / "PRE"
    truth = json.loads((folder / "truth.json").read_text())
    recall = []
    for side in SIDES:
        balls = [b[side] for t in truth["triads"] for b in t["balls"].values() if b[side]["visible"]]
        centres = np.array([ball["center_px"] for ball in balls])
        frame = Frame(decode_image((folder / f"{side}.png").read_bytes()), side)
        found = detect(frame, (9.1, 10.8), replace(THESIS_1995, max_features=60)).features
        distance = np.linalg.norm(found.xy_px[None] - centres[:, None], axis=2).min(axis=1)
        recall.append((distance < 2).mean())
    assert np.mean(recall) > 0.5
