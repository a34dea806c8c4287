"""The files of a new folder of cases."""
import shutil
from importlib import metadata
from pathlib import Path

from .errors import HarnessError

_TEMPLATE = Path(__file__).parent / "template"
_PLACES = {"github.yml": ".github/workflows/validate.yml", "gitlab.yml": ".gitlab-ci.yml"}


def version():
    try:
        return metadata.version("concordem-validate")
    except metadata.PackageNotFoundError:
        return "of the sources"


def write(folder):
    """Write a case, an engine, and workflow files; returns lines about them. Nothing that exists is overwritten."""
    folder = Path(folder)
    files = {path: folder / _PLACES.get(name := str(path.relative_to(_TEMPLATE)), name)
             for path in sorted(_TEMPLATE.rglob("*")) if path.is_file() and "__pycache__" not in path.parts}
    there = [place for place in files.values() if place.exists()]
    if there:
        raise HarnessError(f"{there[0]} exists already; choose another folder")
    for source, place in files.items():
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, place)
    return [*(f"wrote {place}" for place in files.values()), f"next: cd {folder} && concordem-validate run --verbose"]
