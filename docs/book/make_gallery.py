#!/usr/bin/env python3
"""Draw the pictures of the book from small runs. They are committed; run this when the program changes.

    docs/book/make_gallery.py [--concordem PROGRAM] [--only NAME ...] [--results FOLDER]     some ten minutes

`--results` names a folder that keeps the runs, so that pictures can be drawn again at once.
"""

import argparse
import tempfile
from pathlib import Path

from pictures import guides, pages, templates
from pictures.style import BOOK, Runs

PICTURES = {**pages.PICTURES, **guides.PICTURES, **templates.PICTURES}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--concordem", type=Path, default=BOOK.parents[1] / "target/release/concordem", help="the program")
    parser.add_argument("--only", nargs="+", choices=PICTURES, metavar="NAME")
    parser.add_argument("--results", type=Path, help="folder that keeps the runs")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        runs = Runs(options.concordem.resolve(), (options.results or Path(temporary)).resolve())
        for name in options.only or PICTURES:
            PICTURES[name](runs)
            print(name, flush=True)


if __name__ == "__main__":
    main()
