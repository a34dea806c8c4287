"""Published numbers from a case's `reference/table.toml`, with their provenance."""
import tomllib

from ..errors import HarnessError
from ..result import Result

NAME = "table"
NEEDS_START = False


def version():
    return "published numbers"


def run(task, folder, limit):
    path = task.folder / "reference" / "table.toml"
    if not path.exists():
        raise HarnessError(f"{path} is missing; add it")
    table = tomllib.loads(path.read_text())
    if "provenance" not in table:
        raise HarnessError(f"{path} has no key `provenance`; add the source of the numbers")
    values = table.get("variant", {}).get(task.variant)
    if values is None:
        raise HarnessError(f"{path} has no table [variant.{task.variant}]; add it")
    result = Result(NAME, 1.0, provenance={"source": str(table["provenance"])})
    result.numbers["measures"] = values
    return result
