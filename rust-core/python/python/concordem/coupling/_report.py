"""A page that shows a coupled run."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from numbers import Integral
from os import PathLike
from pathlib import Path
from typing import Sequence

import numpy as np

from .._errors import CouplingError

Row = tuple[str, float | int | str, str]

_STYLE = """body { margin: 0 auto; max-width: 1080px; padding: 28px 32px 60px; color: #1f262d;
  font: 16px/1.5 system-ui, "DejaVu Sans", sans-serif; }
h1 { font-size: 27px; } h2 { font-size: 20px; margin-top: 36px; } p { max-width: 84ch; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
td { padding: 6px 16px 6px 0; border-bottom: 1px solid #e7eaed; } td.number { text-align: right; white-space: nowrap; }
img { display: block; max-width: 100%; height: auto; }"""


def _table(rows: Sequence[Row]) -> str:
    lines = []
    for name, value, unit in rows:
        if isinstance(value, str):
            shown = value
        elif not np.isfinite(value):
            raise CouplingError(f'"{name}" is {value}; nothing was written', "NotFinite")
        else:
            shown = str(value) if isinstance(value, Integral) else f"{value:.4g}"
        lines.append(f'<tr><td>{escape(name)}</td><td class="number">{escape(shown)}</td><td>{escape("" if unit == "1" else unit)}</td></tr>')
    return "<table>\n" + "\n".join(lines) + "\n</table>\n"


def write_page(
    path: str | PathLike[str],
    title: str,
    summary: str,
    picture: str | PathLike[str],
    balance: Sequence[Row],
    results: Sequence[Row] = (),
    files: Sequence[str] = (),
) -> None:
    """Write a page (HTML) that shows a coupled run. It needs no other file: the picture (PNG) is inside.

    Args: `summary`: one paragraph. `balance`: energy and momentum over the interface; `results`: other figures; rows of name, value, and
    unit, as text or number; the unit "1" is not shown. `files`: names of the files beside the page, such as ``"beam-*.vtu"``. Raises
    CouplingError for a picture that is no PNG and for numbers that are not finite; nothing is written then.
    """
    if isinstance(files, str):
        raise ValueError(f"files is the text {files!r}; give a list of names")
    data = Path(picture).read_bytes()
    if not data.startswith(b"\x89PNG\r\n\x1a\n"):
        raise CouplingError(f"{picture} is no PNG; nothing was written", "Picture")
    if not balance:
        raise CouplingError("balance is empty; give energy and momentum over the interface", "Balance")
    text = (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{escape(title)}</title>\n<style>\n{_STYLE}\n</style>\n'
        f"</head>\n<body>\n<h1>{escape(title)}</h1>\n<p>{escape(summary)}</p>\n"
        f'<img src="data:image/png;base64,{b64encode(data).decode()}" alt="{escape(title)}">\n'
        f"<h2>Energy and momentum over the interface</h2>\n{_table(balance)}"
    )
    if results:
        text += f"<h2>Results</h2>\n{_table(results)}"
    if files:
        text += "<h2>Files</h2>\n<ul>\n" + "".join(f"<li>{escape(name)}</li>\n" for name in files) + "</ul>\n"
    Path(path).write_text(text + "</body>\n</html>\n", encoding="utf-8")
