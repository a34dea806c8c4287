"""The prebuilt YADE plugin in the wheel."""

import base64
import csv
import hashlib
import io
import subprocess
import sys
import zipfile
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[1] / "native/add_to_wheel.py"
RECORD = "concordem-0.1.0.dist-info/RECORD"
NAME = "concordem/yade/plugins/yade-2025.2.0-0123456789abcdef.so"


def run(*arguments):
    return subprocess.run([sys.executable, SCRIPT, *map(str, arguments)], capture_output=True, text=True, check=False)


def test_a_wheel_with_a_plugin_lists_it(tmp_path):
    wheel, plugin = tmp_path / "concordem-0.1.0-py3-none-any.whl", tmp_path / "site" / NAME
    with zipfile.ZipFile(wheel, "w") as made:
        made.writestr("concordem/__init__.py", "")
        made.writestr(RECORD, f"concordem/__init__.py,sha256=47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU,0\n{RECORD},,\n")
    plugin.parent.mkdir(parents=True)
    # Twice: a second plugin replaces the first.
    for content in (b"first", b"second"):
        plugin.write_bytes(content)
        done = run(wheel, tmp_path / "site")
        assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(wheel) as changed:
        assert changed.testzip() is None
        assert sorted(changed.namelist()) == sorted(["concordem/__init__.py", RECORD, NAME])
        assert changed.read(NAME) == b"second"
        rows = {row[0]: row[1:] for row in csv.reader(io.StringIO(changed.read(RECORD).decode()))}
        assert set(rows) == set(changed.namelist()), "every file is listed"
        digest = base64.urlsafe_b64encode(hashlib.sha256(b"second").digest()).rstrip(b"=").decode()
        assert rows[NAME] == [f"sha256={digest}", "6"]


def test_a_folder_without_plugins_is_refused(tmp_path):
    done = run(tmp_path / "concordem.whl", tmp_path)
    assert done.returncode != 0 and "run yade-bridge/native/prebuilt first" in done.stderr
