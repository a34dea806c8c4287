#!/usr/bin/env python3
"""Add the prebuilt YADE plugins of an unpacked wheel to the wheel: add_to_wheel.py WHEEL FOLDER

FOLDER contains concordem/yade/plugins. The wheel's RECORD lists every file with its hash (PEP 376), so it is written anew.
"""

import base64
import hashlib
import os
import sys
import zipfile
from pathlib import Path


def record(name, data):
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}\n"


def main():
    wheel, folder = map(Path, sys.argv[1:])
    added = {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.glob("concordem/yade/plugins/*.so"))}
    if not added:
        raise SystemExit(f"{folder} has no plugins; run yade-bridge/native/prebuilt first")
    partial = wheel.with_suffix(".partial")
    with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as new:
        lines = ""
        for entry in old.infolist():
            if entry.filename in added:
                continue
            if entry.filename.endswith(".dist-info/RECORD"):
                lines, listing = old.read(entry).decode(), entry.filename
                continue
            new.writestr(entry, old.read(entry))
        lines = "".join(line for line in lines.splitlines(keepends=True) if line.split(",")[0] not in added)
        for name, data in added.items():
            new.writestr(name, data)
            lines = record(name, data) + lines
        new.writestr(listing, lines)
    os.replace(partial, wheel)
    print(f"added {', '.join(added)} to {wheel}")


main()
