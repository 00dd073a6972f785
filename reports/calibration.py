"""The calibration report: one HTML page that needs nothing but itself."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

Document = dict[str, Any]

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1b1f24}
table{border-collapse:collapse;margin:.5rem 0 1.5rem}
td,th{padding:.2rem .7rem;border-bottom:1px solid #d8dde3;text-align:right}
th:first-child,td:first-child{text-align:left}tr.fresh td{background:#eef6ee}.note{color:#57606a}
svg{background:#f6f8fa;border:1px solid #d8dde3;margin:0 1rem 1rem 0}.pair{display:flex;flex-wrap:wrap}
@media print{body{margin:0}}
"""
_PARAMETERS = ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1", "K2", "P1", "P2", "aspect")
_WIDTH = 420
_ENLARGED = 400


def calibration_report(document: Document) -> str:
    """Return the report of a calibration document as HTML."""
    title = f"Calibration of {document['rig']['name']}"
    parts = [
        f"<h1>{escape(title)}</h1>",
        f"<p>{escape(document.get('calibrated_at') or '')} &middot; control field"
        f" {escape(document['control_field']['name'])}</p>",
        _flags(document),
        "<h2>Reconstruction of control points</h2>",
        _shots(document),
        '<p class="note">Standard deviations of residuals. Shots that were used show figures some 1.5 times too good;'
        " the green ones took no part. The rigid motion of the board is removed from every shot but the first.</p>",
        "<h2>Relative orientation</h2>",
        _geometry(document["geometry"]),
        "<h2>Cameras</h2>",
        _cameras({side: document["rig"][side] for side in ("left", "right")}, document["cameras"]),
        "<h2>Strong correlations</h2>",
        _correlations(document),
        "<h2>Angles and distances on the board</h2>",
        _angles(document),
        "<h2>Where the points are, and their image residuals</h2>",
        _pictures(document),
    ]
    return _page(title, parts)


def cameras_report(document: Document) -> str:
    """Return the report of a document of cameras, any number of them, as HTML."""
    title = f"Calibration of {len(document['cameras'])} camera(s)"
    cameras = {c["name"]: c for c in document["cameras"]}
    parts = [
        f"<h1>{escape(title)}</h1>",
        f"<p>{escape(document['calibrated_at'])}</p>",
        _flags(document),
        "<h2>Cameras</h2>",
        _cameras(cameras, document["quality"]),
        "<h2>Reconstruction of control points by every two cameras</h2>",
        _reconstructions(document),
        '<p class="note">Standard deviations of residuals, which took part in the adjustment and look some 1.5 times'
        " too good. The rigid motion of the board is removed from every shot but the first.</p>",
    ]
    return _page(title, parts)


def _page(title: str, parts: Sequence[str]) -> str:
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style><body>{''.join(parts)}</body></html>\n"
    )


def _reconstructions(document: Document) -> str:
    rows = [
        [escape(" and ".join(pair["cameras"])), escape(s["name"]), str(s["reconstructed"])]
        + [_number(v, 3) for v in s["sd_mm"]]
        for pair in document["pairs"]
        for s in pair["shots"]
    ]
    head = ["cameras", "shot", "points", "X mm", "Y mm", "Z mm"]
    return _table(head, rows) if rows else "<p>No two cameras see the same points.</p>"


def _flags(document: Document) -> str:
    items = "".join(
        f"<li>{escape(f['detail'])} <code>{escape(f['code'])}</code></li>" for f in document["flags"]
    )
    return f"<ul>{items}</ul>" if items else "<p>No remarks.</p>"


def _shots(document: Document) -> str:
    rows = [(shot, *_accuracy(shot)) for shot in document["shots"]]
    if document["leave_one_out"]:
        rows.append((document["leave_one_out"], *_accuracy(document["leave_one_out"])))
    body = "".join(
        f"<tr{'' if shot['used'] else ' class=fresh'}>{''.join(f'<td>{escape(c)}</td>' for c in cells)}</tr>"
        for shot, *cells in rows
    )
    return f"<table>{_head(['shot', 'used', 'points', 'X mm', 'Y mm', 'Z mm', 'left px', 'right px'])}{body}</table>"


def _accuracy(shot: Document) -> list[str]:
    rms = [_number(shot.get(f"image_rms_{side}_px"), 3) for side in ("left", "right")]
    sd = [_number(v, 3) for v in shot["sd_mm"]]
    return [shot["name"], "yes" if shot["used"] else "no", str(shot["reconstructed"]), *sd, *rms]


def _geometry(g: Document) -> str:
    near, far = (_number(v, 0) for v in g["depth_of_field_mm"])
    rows = [
        ("baseline", f"{g['baseline_mm']:.2f} &plusmn; {_number(g['baseline_sd_mm'], 2)} mm"),
        ("vergence", f"{g['vergence_deg']:.3f} &plusmn; {_number(g['vergence_sd_deg'], 3)}&deg;"),
        ("range, left and right", f"{g['range_mm'][0]:.0f} and {g['range_mm'][1]:.0f} mm"),
        ("common field of view", f"{g['field_of_view_mm'][0]:.0f} &times; {g['field_of_view_mm'][1]:.0f} mm"),
        (f"depth of field at f/{g['f_number']:g}", f"{near} to {far} mm"),
        ("depth spanned by the control points", f"{g['control_depth_mm']:.0f} mm"),
    ]
    return "<table>" + "".join(f"<tr><td>{a}</td><td>{b}</td></tr>" for a, b in rows) + "</table>"


def _cameras(cameras: Document, quality: Document) -> str:
    """Return the parameters of cameras by name, each with its standard deviation."""
    columns = {name: _parameters(camera, quality[name]["sd"]) for name, camera in cameras.items()}
    rows = [
        [key] + [cell for column in columns.values() for cell in (f"{column[key][0]:.6g}", column[key][1])]
        for key in _PARAMETERS
    ]
    for key, digits in (("image_rms_px", 3), ("points", 0)):
        cells = [cell for name in columns for cell in (_number(quality[name][key], digits), "")]
        rows.append([key.replace("_", " "), *cells])
    return _table(["", *(cell for name in columns for cell in (escape(name), "&plusmn;"))], rows)


def _parameters(camera: Document, sd: Document) -> dict[str, tuple[float, str]]:
    px, py = camera["pixel_size_mm"]
    values = [
        *camera["position_mm"],
        *camera["rotation_deg"],
        camera["focal_length_mm"],
        *camera["principal_point_mm"],
        *camera["radial"],
        *camera["decentering"],
        py / px,
    ]
    spoken = [
        f"{sd[n]:.2g}" if sd.get(n) is not None else "fixed" if n not in sd else "?" for n in _PARAMETERS
    ]
    return dict(zip(_PARAMETERS, zip(values, spoken, strict=True), strict=True))


def _correlations(document: Document) -> str:
    found = sorted(document["correlations_above_0.9"], key=lambda c: -abs(c["correlation"]))
    rows = [[escape(" and ".join(c["between"])), f"{c['correlation']:+.3f}"] for c in found]
    return _table(["parameters", "correlation"], rows) if rows else "<p>None above 0.9.</p>"


def _angles(document: Document) -> str:
    rows = [
        [
            f"{e['size_mm']:.0f}",
            f"{e['distance_rms_mm']:.3f}",
            f"{e['angle_rms_deg']:.3f}",
            str(e["measurements"]),
        ]
        for e in document["angles_on_board"]
    ]
    return _table(["size mm", "distance error mm", "angle error &deg;", "angles"], rows)


def _pictures(document: Document) -> str:
    parts = []
    for shot in document["shots"]:
        frames = "".join(_picture(document, shot, side) for side in ("left", "right"))
        parts.append(f'<h3>{escape(shot["name"])}</h3><div class="pair">{frames}</div>')
    return "".join(parts)


def _picture(document: Document, shot: Document, side: str) -> str:
    width, height = document["rig"][side]["image_size_px"]
    scale = _WIDTH / width
    removed = {(r["shot"], r["id"]) for r in document["removed"] if r["side"] == side}
    marks = []
    for point in shot["points"][side]:
        x, y = point["u_px"] * scale, point["v_px"] * scale
        colour = "#c62828" if (shot["name"], point["id"]) in removed else "#1565c0"
        marks.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>'
            f'<text x="{x + 5:.1f}" y="{y - 4:.1f}" font-size="11">{escape(point["id"])}</text>'
        )
        if "residual_px" in point:
            du, dv = (_ENLARGED * scale * r for r in point["residual_px"])
            marks.append(
                f'<path d="M{x:.1f} {y:.1f}l{du:.1f} {dv:.1f}" stroke="#e65100" stroke-width="1.5"/>'
            )
    foot = f'<text x="6" y="{height * scale - 6:.0f}" font-size="11">{side}; residuals x {_ENLARGED}</text>'
    frame = f'<svg width="{_WIDTH}" height="{height * scale:.0f}" role="img" aria-label="{side} image">'
    return f"{frame}{''.join(marks)}{foot}</svg>"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table>{_head(head)}{body}</table>"


def _head(cells: Sequence[str]) -> str:
    return f"<tr>{''.join(f'<th>{cell}</th>' for cell in cells)}</tr>"


def _number(value: float | None, digits: int) -> str:
    return "&ndash;" if value is None else f"{value:.{digits}f}"
