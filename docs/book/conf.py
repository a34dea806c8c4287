"""Sphinx configuration. `docs/build` runs everything; this file alone builds the pages."""

import importlib.util
import os
import re
from pathlib import Path

HERE = Path(__file__).parent

project = "ConcorDEM"
author = "The ConcorDEM developers"
copyright = author
extensions = ["myst_parser", "sphinx.ext.mathjax", "sphinx_copybutton"]
exclude_patterns = ["_build"]
myst_enable_extensions = ["attrs_block", "attrs_inline", "deflist", "dollarmath"]
myst_heading_anchors = 3
myst_dmath_double_inline = True
suppress_warnings = ["myst.header"]

html_theme = "furo"
html_title = "ConcorDEM"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
html_css_files = ["book.css"]

# MathJax comes from a wheel, with all extensions of TeX in one file: the pages need no network.
_mathjax = importlib.util.find_spec("sphinx-mathjax-offline")
if _mathjax is None or _mathjax.origin is None:
    raise RuntimeError("install docs/requirements.txt")
html_static_path = ["_static", str(Path(_mathjax.origin).parent / "static/mathjax/tex-svg-full.js")]
mathjax_path = "tex-svg-full.js"
mathjax3_config = {"options": {"enableMenu": False}}

copybutton_prompt_text = "$ "

# Pages whose text another folder owns; a branch without that text gets a page that says so.
INCLUDED = {"reference/glossary": "docs/glossary.md", "reference/limits": "docs/limits.md", "reference/performance": "docs/performance.md"}


def _replace_missing(_app, docname, source):
    path = INCLUDED.get(docname)
    if path and not (HERE.parents[1] / path).exists():
        source[0] = source[0].split("```")[0] + f"`{path.split('/')[-1]}` is not written yet.\n"


def _relocate_links(_app, relative_path, _parent, content):
    """Links of an included file start from its own folder; those to files outside of the book become paths."""
    folder = (HERE / relative_path).resolve().parent
    if folder != HERE.parent:
        return

    def moved(link):
        text, target, anchor = link[1], link[2], link[3] or ""
        path = (folder / target).resolve()
        if HERE in path.parents:
            return f"[{text}]({os.path.relpath(path, HERE / 'reference')}{anchor})"
        return f"{text} (`{path.relative_to(HERE.parents[1])}`)" if path.exists() else link[0]

    content[0] = re.sub(r"\[([^\]]*)\]\((?!\w+:)([^)#\s]+)(#[^)\s]*)?\)", moved, content[0])


def setup(app):
    app.connect("include-read", _relocate_links)
    app.connect("source-read", _replace_missing)
