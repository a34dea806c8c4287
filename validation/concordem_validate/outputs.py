"""Outputs for machines: JUnit XML and a badge. The JSON record is `round.json` (`rounds.py`)."""
import math
import xml.etree.ElementTree as xml

from . import compare, rounds
from .case import Check
from .process import plain

_COLORS = {rounds.AGREES: "#3c9a4e", rounds.FAILED: "#c0392b", rounds.ENGINE_MISSING: "#b58900", rounds.NOTHING_CHECKED: "#7f8c8d"}


def junit(round_):
    """JUnit XML: a suite for each case, a test for each verdict; known differences pass, missing engines are skipped."""
    top = xml.Element("testsuites", name="concordem-validate")
    verdicts = [*round_.starts, *round_.verdicts, *round_.changes]
    for case in dict.fromkeys(v.case for v in verdicts):
        mine = [v for v in verdicts if v.case == case]
        suite = xml.SubElement(top, "testsuite", name=case, tests=str(len(mine)), failures=str(sum(v.status == "fail" for v in mine)),
                               skipped=str(sum(v.status in ("missing", "skipped") for v in mine)), errors="0")
        for v in mine:
            test = xml.SubElement(suite, "testcase", classname=f"{case}.{v.variant}", name=f"{v.check.name}: {v.reference} and {v.peer}")
            size = "" if math.isnan(v.difference) else f"difference {v.difference:.3g}"
            text = "; ".join(filter(None, [size, v.message]))
            if v.status == "fail":
                xml.SubElement(test, "failure", type=v.cause or "difference", message=text).text = f"{text}\n{v.check.reason.strip()}"
            elif v.status in ("missing", "skipped"):
                xml.SubElement(test, "skipped", message=text)
            else:
                xml.SubElement(test, "system-out").text = f"{'known: ' + v.check.quirk + '; ' if v.status == 'known' else ''}{text}"
    for o in round_.outcomes.values():
        if o.status not in ("done", "missing", "skipped"):
            suite = next((s for s in top if s.get("name") == o.case), None)
            if suite is None:
                suite = xml.SubElement(top, "testsuite", name=o.case, tests="0", failures="0", skipped="0", errors="0")
            test = xml.SubElement(suite, "testcase", classname=f"{o.case}.{o.variant}", name=f"run of {o.engine}")
            xml.SubElement(test, "error", type=o.status, message=o.message.splitlines()[0] if o.message else o.status).text = o.message
            for key in ("errors", "tests"):
                suite.set(key, str(int(suite.get(key)) + 1))
    for one in top.iter():
        # XML has no place for control characters, which engines and names may have
        one.attrib = {key: plain(value) for key, value in one.attrib.items()}
        one.text = plain(one.text) if one.text else one.text
    xml.indent(top)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + xml.tostring(top, encoding="unicode") + "\n"


def badge(round_, code):
    """A badge as SVG."""
    counts = round_.counts()
    text = {rounds.AGREES: f"{counts['pass'] + counts['known']} agree", rounds.ENGINE_MISSING: "engine missing",
            rounds.NOTHING_CHECKED: "nothing checked"}.get(code, f"{counts['fail']} fail")
    left, right = 76, 7 * len(text) + 12
    cell = lambda x, width, color, words: (f'<rect x="{x}" width="{width}" height="20" fill="{color}"/><text x="{x + width / 2:g}" y="14" '
                                           f'fill="#fff" font-family="sans-serif" font-size="11" text-anchor="middle">{words}</text>')
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + right}" height="20" role="img"><title>validation: {text}</title>'
            f'{cell(0, left, "#555", "validation")}{cell(left, right, _COLORS.get(code, "#555"), text)}</svg>\n')


def start_verdict(row):
    """A verdict about a start state from a record."""
    check = Check(row["check"], "start", row["peer"], ["*"], row["reason"], of="start", tolerance=row["tolerance"])
    return compare.Verdict(row["case"], row["variant"], check, row["status"], 0.0 if row["difference"] == 0 else math.nan, row["message"],
                           row["cause"], reference=row["reference"])
