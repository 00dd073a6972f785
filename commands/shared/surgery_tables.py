"""Tables of a measured surgery, with standard deviations and coordinate frames."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from commands.shared.api_client import Document

_LOG_WIDTH = 100
_NO_LABEL = "?"


def print_triads(stages: Mapping[str, Document]) -> None:
    """Print position and normal of every triad by stage, and their coordinate frame."""
    columns = ["", "", *(f"{axis} mm" for axis in "XYZ"), "α°", "β°", "γ°", "", "err."]
    table = new_table("Triads: position of P and direction of the normal", columns)
    for name, stage in stages.items():
        for triad in stage["triads"]:
            if triad["position_mm"] is None:
                table.add_row(name, triad["label"] or _NO_LABEL, *["-"] * 8)
                continue
            position = _with_sd(triad["position_mm"], triad["position_sd_mm"])
            angles = (f"{angle:.1f}" for angle in triad["angles_deg"])
            tilt_sd = max(triad["rotation_sd_deg"][:2])  # an upper bound for each of the three angles
            error = f"{triad['error_mm']:.2f}"
            table.add_row(name, triad["label"] or _NO_LABEL, *position, *angles, f"±{tilt_sd:.1f}", error)
        table.add_section()
    print_table(table)
    for frame in sorted({stage["frame"] for stage in stages.values()}):
        print_note(f"in {frame}; ± one standard deviation; err.: error of the ball distances, mm\n")


def print_motion(motion: Document) -> None:
    """Print the motion of every vertebra between two stages, and its coordinate frame."""
    columns = ["", *(f"Δ{axis} mm" for axis in "xyz"), *(f"rot. {axis}°" for axis in "xyz"), "angle°"]
    table = new_table(f"Motion from {motion['from']['name']} to {motion['to']['name']}", columns)
    for item in motion["vertebrae"]:
        translation = _with_sd(item["translation_mm"], item["translation_sd_mm"])
        rotation = _with_sd(item["rotation_vector_deg"], item["rotation_sd_deg"], digits=1)
        table.add_row(item["vertebra"], *translation, *rotation, _angle(item))
    print_table(table)
    for item in motion["missing"]:
        print_note(f"{item['vertebra']}: {item['reason']}")
    print_note(
        f"in the frame of {motion['frame']}; rotations are rotation vectors; ± one standard deviation, the angle with"
        " its 95% interval\n"
    )


def print_flags(stages: Mapping[str, Document], jobs: Mapping[str, Document]) -> None:
    """Print the flags of each stage, and the error of each job that did not succeed."""
    for name, stage in stages.items():
        for flag in stage.get("flags") or []:
            print_note(f"{name}: {flag['detail']} [{flag['code']}]")
        if error := jobs[name].get("error"):
            print_note(f"{name}: {jobs[name]['state']}: {error.get('detail') or error.get('title')}")


def print_note(text: str) -> None:
    """Print a line of text."""
    print_table(text)


def print_links(url: str, surgery: str) -> None:
    """Print the URLs of the surgery and of the API documentation."""
    print_note(f"Surgery:  {url}{surgery}\nAPI docs: {url}/docs")


def _angle(moved: Document) -> str:
    """Return the angle of a rotation with its interval: it is never negative, so that a deviation would mislead."""
    low, high = moved["angle_interval_deg"]
    return f"{moved['angle_deg']:.1f} ({low:.1f} to {high:.1f})"


def _with_sd(values: Sequence[float], deviations: Sequence[float], digits: int = 2) -> Iterable[str]:
    pairs = zip(values, deviations, strict=True)
    return (f"{value:.{digits}f}±{deviation:.{digits}f}" for value, deviation in pairs)


def new_table(title: str, columns: Sequence[str]) -> Table:
    """Return an empty table in the style of all tables; columns of numbers are those with a name."""
    table = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE, show_edge=False, pad_edge=False
    )
    table.padding = (0, 1, 0, 0)
    for column in columns:
        table.add_column(column, justify="right" if column else "left", no_wrap=True)
    return table


def print_table(content: Table | str, log_width: int = _LOG_WIDTH) -> None:
    """Print a table or a line of text as wide as the terminal; in a log, ``log_width`` characters wide."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=log_width)
    console.print(content, markup=False, highlight=False, soft_wrap=isinstance(content, str))
