"""The bed and the ball of the small case."""
import runpy
from pathlib import Path

_SMALL = runpy.run_path(str(Path(__file__).parents[1] / "penetration" / "case.py"))
scenario, measures, curves = (_SMALL[name] for name in ("scenario", "measures", "curves"))
