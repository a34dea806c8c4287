"""`pytest --concordem-cases DIR`: every check of every case is a test. Known differences are expected failures; missing engines are skipped.

Engines come from `--concordem-config`, by default `validate.toml` beside the tests. A case runs when the first of its tests does.
"""
from pathlib import Path

import pytest


def pytest_addoption(parser):
    group = parser.getgroup("concordem-validate")
    group.addoption("--concordem-cases", action="append", default=[], metavar="DIR", help="folder of cases, each check of which is a test")
    group.addoption("--concordem-config", metavar="FILE", help="file of engines; default: validate.toml in the root of the tests")
    group.addoption("--concordem-strict", action="store_true", help="a missing engine fails its tests")


def pytest_collection_modifyitems(session, config, items):
    folders = config.getoption("--concordem-cases")
    if folders:
        items += [Check.from_parent(session, name=name, rounds=rounds, case=case, verdict=k)
                  for rounds, case, k, name in _found(config, folders)]


def _found(config, folders):
    """All checks of all variants, in the order of their verdicts."""
    from . import case as cases
    from . import project
    from .errors import HarnessError
    own = Path(config.getoption("--concordem-config") or config.rootpath / project.NAME)
    try:
        made = project.load(own if own.exists() or config.getoption("--concordem-config") else None, folders)
        rounds = _Rounds(made.output)
        for root in made.roots:
            for name in cases.names(root):
                case = cases.load(name, root)
                names = [f"{name}::{v}::{c.name}::{c.pair[0]}-{c.pair[1]}" for c in case.checks
                         for v in (["all"] if c.kind == "ensemble" else case.variants_of(c))]
                yield from ((rounds, case, k, text) for k, text in enumerate(names))
    except HarnessError as error:
        raise pytest.UsageError(str(error)) from None


class _Rounds:
    """One round for each case, made when it is first asked for."""

    def __init__(self, folder):
        self.folder, self.made = folder, {}

    def of(self, case):
        from . import runner
        if case.name not in self.made:
            self.made[case.name] = runner.Runner(self.folder, quiet=True).run([case])
        return self.made[case.name]


class Failed(Exception):
    """A check that failed; its text is all that there is to say."""


class Check(pytest.Item):
    def __init__(self, *, rounds, case, verdict, **options):
        super().__init__(**options)
        self.rounds, self.case, self.number = rounds, case, verdict

    def runtest(self):
        round_ = self.rounds.of(self.case)
        verdict = round_.verdicts[self.number]
        for start in round_.starts:
            if start.status == "fail" and start.variant == verdict.variant:
                raise Failed(start.message)
        text = f"{verdict.check.name}: {verdict.reference} and {verdict.peer} differ by {verdict.difference:.3g}. {verdict.message}"
        if verdict.status == "known":
            pytest.xfail(f"{text} known: {verdict.check.quirk}")
        if verdict.status in ("missing", "skipped") and not (verdict.status == "missing" and self.config.getoption("--concordem-strict")):
            pytest.skip(verdict.message)
        if verdict.status != "pass":
            raise Failed(f"{text}\nAllowed: {verdict.check.allowed}. {verdict.check.reason.strip()}")

    def repr_failure(self, excinfo):
        return str(excinfo.value) if isinstance(excinfo.value, Failed) else super().repr_failure(excinfo)

    def reportinfo(self):
        return self.case.folder / "case.toml", 0, self.name
