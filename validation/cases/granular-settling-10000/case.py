"""As `granular-settling`, with more spheres."""
import importlib.util
from pathlib import Path

_path = Path(__file__).parents[1] / "granular-settling" / "case.py"
_spec = importlib.util.spec_from_file_location("granular_settling", _path)
_small = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_small)
scenario, measures = _small.scenario, _small.measures
