"""A round: what each engine did, the verdicts, and the record `round.json` from which a report needs no engine."""
import hashlib
import json
import math
import os
import platform
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path

import h5py

from .errors import HarnessError, Incomparable
from .process import plain
from .result import Result, check_seal

RECORD = "round.json"
FORMAT = "concordem-validate round 1"
AGREES, FAILED, WRONG_INPUT, ENGINE_MISSING, NOTHING_CHECKED = 0, 1, 2, 3, 5


@dataclass
class Outcome:
    """Outcome of one engine on one variant."""

    case: str
    variant: str
    engine: str
    status: str  # done, missing, skipped, timeout, crashed, unsupported, empty, stale, error
    message: str = ""
    path: Path = None
    kept: bool = False
    sha256: str = None  # of the stored result, as its file ends

    def result(self):
        """The stored result; refuses one of another case or engine, and one that is not what the round has written."""
        self._check()
        result = Result.read(self.path)
        _of_this(self, result.provenance, self.path)
        return result

    def _check(self):
        found = check_seal(self.path, needed=True)
        if self.sha256 not in (None, found):
            raise Incomparable("error", f"{self.path} is not the file of this round: its hash is not that in {RECORD}; make the round again")

    def provenance(self):
        """Provenance of the stored result, without its arrays; empty if it cannot be read, or is another's."""
        try:
            self._check()
            with h5py.File(self.path, "r", locking=False) as file:
                provenance = {k: str(v) for k, v in file["provenance"].attrs.items()}
            _of_this(self, provenance, self.path)
        except (OSError, KeyError, RuntimeError, HarnessError):
            return {}
        return provenance

    def is_whole(self, key):
        """Whether the stored result is there, can be read, and is that of these inputs."""
        return self.provenance().get("key") == key


def _of_this(outcome, provenance, path):
    told = [str(provenance.get(k)) for k in ("case", "variant")]
    if told != [outcome.case, outcome.variant]:
        raise Incomparable("error", f"{path} holds a result of {' · '.join(told)}, not of {outcome.case} · {outcome.variant}; files were exchanged")
    key = provenance.get("key")
    if key and f".{key}." not in path.name:
        raise Incomparable("error", f"{path} holds the result of another run ({key}); files were exchanged")


@dataclass
class Round:
    """All outcomes and verdicts of a round."""

    outcomes: dict = field(default_factory=dict)
    verdicts: list = field(default_factory=list)
    starts: list = field(default_factory=list)
    changes: list = field(default_factory=list)  # against a baseline
    times: dict = field(default_factory=dict)  # pairs of seconds by case, variant, reference, and peer
    shard: str = None  # K/N where the round is one of N parts
    wanted: list = field(default_factory=list)  # names of the cases of all parts
    lacking: list = field(default_factory=list)  # required engines that computed nothing

    def failed(self, strict):
        """Whether the round is not good; with `strict` a missing engine counts."""
        return self.exit_code(strict) not in (AGREES,)

    def exit_code(self, strict, require=()):
        missing = {o.engine for o in self.outcomes.values() if o.status == "missing"}
        if self.counts()["fail"]:
            return FAILED
        if missing and strict or missing & set(require) or self.lacking:
            return ENGINE_MISSING
        if self.absent() or not self._checked():
            return NOTHING_CHECKED
        return AGREES

    def _checked(self):
        # there may be more parts than cases
        return self.shard and not self.outcomes or any(v.status in ("pass", "known") for v in [*self.verdicts, *self.changes])

    def absent(self):
        """Cases of other parts that a whole round lacks. A part by itself is good without them."""
        return [] if self.shard else [name for name in self.wanted if name not in {o.case for o in self.outcomes.values()}]

    def counts(self):
        """How many checks have each outcome. Start states, changes, and runs that failed without a check of theirs are failures, too."""
        words = ("pass", "known", "fail", "missing", "skipped")
        found = {word: sum(v.status == word for v in self.verdicts) for word in words}
        told = {(v.case, v.variant, name) for v in self.verdicts if v.status == "fail" for name in (v.reference, v.peer)}
        found["fail"] += sum(v.status == "fail" for v in [*self.starts, *self.changes])
        found["fail"] += sum((o.case, o.variant, o.engine) not in told for o in self.outcomes.values() if o.status not in ("done", "missing", "skipped"))
        return found


def _plain(value):
    """A number for JSON, which has no NaN."""
    return None if value is None or isinstance(value, float) and not math.isfinite(value) else value


def describe(verdict):
    check = verdict.check
    limit = dict(known=check.known, quirk=check.quirk) if check.known else dict(band=check.band) if check.band else dict(tolerance=check.tolerance)
    return dict(case=verdict.case, variant=verdict.variant, check=check.name, kind=check.kind, of=check.of, reference=verdict.reference,
                peer=verdict.peer, status=verdict.status, cause=verdict.cause, difference=_plain(verdict.difference), **limit, norm=check.norm,
                reason=check.reason.strip(), message=plain(verdict.message))


def write(folder, round_, code):
    """Write the record of a round; paths are relative to it, so that the folder can move."""
    path = Path(folder) / RECORD
    data = dict(
        format=FORMAT, date=datetime.now(timezone.utc).isoformat(timespec="seconds"), host=platform.platform(), cores=os.cpu_count(), exit_code=code,
        counts=round_.counts(), shard=round_.shard, wanted=round_.wanted, lacking=round_.lacking,
        outcomes=[dict(case=o.case, variant=o.variant, engine=o.engine, status=o.status, message=o.message,
                       path=os.path.relpath(o.path, folder) if o.path else None, kept=o.kept, sha256=o.sha256 or _hash(o)) for o in round_.outcomes.values()],
        verdicts=[describe(v) for v in round_.verdicts], starts=[describe(v) for v in round_.starts],
        changes=[describe(v) for v in round_.changes],
        times=[dict(case=c, variant=v, reference=a, peer=b, seconds=s) for (c, v, a, b), s in round_.times.items()])
    data["sha256"] = _seal(data)
    partial = path.with_name(f".{RECORD}.{os.getpid()}")
    partial.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n")
    partial.replace(path)
    return path


def _hash(outcome):
    try:
        return check_seal(outcome.path, needed=True) if outcome.path else None
    except HarnessError:
        return None  # its verdict says so


def _seal(data):
    """Hash of a record, so that one that was cut off or changed by hand is no record."""
    return hashlib.sha256(json.dumps({k: v for k, v in data.items() if k != "sha256"}, sort_keys=True).encode()).hexdigest()


def record(folder):
    path = Path(folder) / RECORD
    if not path.exists():
        raise HarnessError(f"{path} does not exist; make a round with `run --output {folder}`")
    try:
        data = json.loads(path.read_text())
    except (ValueError, OSError) as error:
        raise HarnessError(f"{path}: {error}; the record is damaged, so make the round again") from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        found = data.get("format") if isinstance(data, dict) else data
        raise HarnessError(f"{path} has the format {found!r}, this version reads {FORMAT!r}; make the round again")
    if data.get("sha256") != _seal(data):
        raise HarnessError(f"{path} is not what a round has written; it was changed or damaged, so make the round again")
    return data


def outcomes(folder):
    """The outcomes of a recorded round; no engine is asked."""
    return {(o["case"], o["variant"], o["engine"]): Outcome(
        o["case"], o["variant"], o["engine"], o["status"], o["message"], Path(folder) / o["path"] if o["path"] else None, True,
        # one without a hash is none of ours
        o.get("sha256") or "none")
        for o in record(folder)["outcomes"]}


def times(folder):
    """The run times of a recorded round, which machines with other rounds do not change: both of a pair are of one machine."""
    return {(t["case"], t["variant"], t["reference"], t["peer"]): t["seconds"] for t in record(folder).get("times", [])}


def again(folder):
    """A recorded round without its verdicts, which are made again."""
    data = record(folder)
    return Round(outcomes(folder), times=times(folder), shard=data.get("shard"), wanted=data.get("wanted", []), lacking=data.get("lacking", []))
