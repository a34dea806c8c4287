"""Baselines: results of a round, stored with their hashes and provenance, and what differs from them later."""
import hashlib
import json
import shutil
from datetime import datetime, timezone
from pathlib import Path

from . import compare, difference, rounds
from .case import Check
from .errors import HarnessError
from .result import Result

MANIFEST = "manifest.json"
FORMAT = "concordem-validate baseline 1"


def _digest(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def bless(output, folder):
    """Store the finished results of the last round; a baseline is never overwritten."""
    if folder.exists():
        raise HarnessError(f"{folder} exists already; choose another name, or remove it")
    record = rounds.record(output)
    bad = [v for v in record["verdicts"] if v["status"] == "fail"]
    if bad:
        raise HarnessError(f"{len(bad)} checks of the round failed, first {bad[0]['case']} · {bad[0]['check']}; mend them before you bless it")
    broken = [o for o in record["outcomes"] if o["status"] not in ("done", "missing", "skipped")]
    if broken:
        raise HarnessError(f"{broken[0]['engine']} {broken[0]['status']} in the round, in {broken[0]['case']}; mend it before you bless it")
    if any(v["status"] == "fail" for v in record["starts"]):
        raise HarnessError("a start state of the round is wrong; mend it before you bless it")
    if not any(v["status"] in ("pass", "known") for v in record["verdicts"]):
        raise HarnessError("nothing was checked in the round, so nothing says that its results are right; add the engines that checks need")
    done = [o for o in record["outcomes"] if o["status"] == "done"]
    if not done:
        raise HarnessError(f"{output} has no finished result; make a round first")
    stored = rounds.outcomes(output)
    read = [stored[one["case"], one["variant"], one["engine"]].result().provenance for one in done]
    folder.mkdir(parents=True)
    rows = []
    for one, about in zip(done, read):
        source = Path(output) / one["path"]
        name = f"{one['case']}.{one['variant']}.{one['engine']}.h5"
        shutil.copy(source, folder / name)
        rows.append(dict(case=one["case"], variant=one["variant"], engine=one["engine"], file=name, sha256=_digest(folder / name),
                         **{k: about.get(k) for k in ("engine_version", "case_hash", "harness_hash", "start_hash", "host", "date")}))
    data = dict(format=FORMAT, date=datetime.now(timezone.utc).isoformat(timespec="seconds"), results=rows)
    (folder / MANIFEST).write_text(json.dumps(data, indent=1) + "\n")
    return folder, len(rows)


def load(folder):
    """Rows of a baseline by case, variant, and engine; refuses files that have changed since."""
    path = folder / MANIFEST
    if not path.exists():
        raise HarnessError(f"there is no baseline {folder}; store one with `bless {folder.name}`")
    try:
        data = json.loads(path.read_text())
        named = [(row["case"], row["variant"], row["engine"], row["file"], row["sha256"]) for row in data["results"]]
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise HarnessError(f"{path}: {type(error).__name__}: {error}; the list of results is damaged, so restore it") from None
    if data.get("format") != FORMAT:
        raise HarnessError(f"{path} has the format {data.get('format')!r}, this version reads {FORMAT!r}; bless a round again")
    for *_, name, digest in named:
        file = folder / name
        if not file.exists() or _digest(file) != digest:
            raise HarnessError(f"{file} is missing or is not the file that was blessed; restore it")
    return {(case, variant, engine): folder / name for case, variant, engine, name, _ in named}


def against(round_, folder, tolerance=0.0, few=False):
    """A verdict about each result that the baseline has of the round's cases: the same bits, or what changed, and why. `few`: the round
    was asked for some engines only."""
    stored = load(folder)
    if not stored.keys() & round_.outcomes.keys():
        raise HarnessError(f"the round has no result that the baseline {folder} also has, so nothing is compared with it; bless a round of these cases")
    out = []
    ran = {case for case, _, _ in round_.outcomes}
    for case, variant, engine in stored.keys() - round_.outcomes.keys():
        if case in ran and not few:
            check = _check(folder, engine, tolerance)
            out.append(compare.Verdict(case, variant, check, "fail", cause="error", reference=engine, message=(
                f"{engine} is in the baseline, but this round did not run it; bless a new baseline if the case was changed")))
    for key, outcome in round_.outcomes.items():
        if key not in stored:
            continue
        verdict = compare.Verdict(key[0], key[1], _check(folder, key[2], tolerance), "fail", reference=key[2])
        out.append(verdict)
        if outcome.status != "done":
            verdict.status, verdict.cause = ("missing", "") if outcome.status == "missing" else ("fail", outcome.status)
            verdict.message = f"{outcome.engine} {outcome.status}: {outcome.message}"
            continue
        try:
            _one(verdict, outcome.result(), Result.read(stored[key]), tolerance)
        except HarnessError as error:
            compare.fail(verdict, error)
    return out


def _check(folder, engine, tolerance):
    return Check(f"as in {folder.name}", "baseline", folder.name, ["*"], "The same code on the same case gives the same result.",
                 of="all series", tolerance=tolerance, reference=engine)


def _one(verdict, new, old, tolerance):
    found = difference.same_bits(new, old)
    if not found:
        verdict.status, verdict.difference, verdict.message = "pass", 0.0, "the same bits"
        return
    lines, good = difference.files(new, old, tolerance, names=("now", verdict.peer)) if tolerance > 0 else (found, False)
    verdict.status = "pass" if good else "fail"
    verdict.cause = "" if good else "difference"
    verdict.message = "; ".join(found[:4] if tolerance == 0 else [line for line in lines if not good] or found[:1]) \
        + f" ({difference.cause(new, old)})"
