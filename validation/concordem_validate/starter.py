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
    """Write a case, an engine, and workflow files; a project gets the workflow files that it lacks. Nothing that exists is overwritten."""
    folder = Path(folder)
    project = (folder / "validate.toml").exists()
    files = {path: folder / _PLACES.get(name := str(path.relative_to(_TEMPLATE)), name)
             for path in sorted(_TEMPLATE.rglob("*")) if path.is_file() and "__pycache__" not in path.parts and (path.name in _PLACES or not project)}
    there = [place for place in files.values() if place.exists()]
    if project:
        files = {source: place for source, place in files.items() if place not in there}
    elif there:
        raise HarnessError(f"{there[0]} exists already; choose another folder")
    for source, place in files.items():
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, place)
    return [*(f"kept {place}" for place in there), *(f"wrote {place}" for place in files.values()), f"next: cd {folder} && concordem-validate run --verbose"]
