"""What notebooks show of scenarios, simulations, and results."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._core import Result, Scenario, Simulation


def _table(title: str, facts: list[tuple[str, str]]) -> str:
    rows = "".join(f"<tr><th style='text-align:left'>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in facts)
    return f"<table><caption>{escape(title)}</caption>{rows}</table>"


def simulation(of: Simulation) -> str:
    """Facts about a simulation at this moment."""
    state, summary = of.state, of.summary
    facts = [
        ("particles", f"{len(state):,}"),
        ("bonds", f"{state.bond_count:,} of {summary.bonds:,}"),
        ("step", f"{state.step:,}"),
        ("time", f"{state.time:.6g} s"),
        ("time step", f"{state.time_step:.4g} s"),
        ("progress", "not known" if of.progress is None else f"{100 * of.progress:.0f} %"),
        ("ended because of", of.stopped or "not ended"),
    ]
    samples = of.samples
    if len(samples):
        facts.append(("last record", f"strain {samples['strain'][-1]:.4g}, stress {samples['stress'][-1]:.4g} Pa"))
    return _table(f"Simulation of {of.scenario.title or of.scenario.name}", facts)


def scenario(of: Scenario) -> str:
    """Title and text of a scenario, which is folded."""
    head = escape(of.title or of.name)
    return f"<details><summary>Scenario {head}</summary><pre>{escape(of.text)}</pre></details>"


def result(of: Result) -> str:
    """Facts about a result."""
    known = of.provenance
    facts = [("file", str(of.path)), ("records", f"{len(of.samples):,}"), ("snapshots", f"{len(of.snapshot_times):,}")]
    facts += [("events", f"{len(of.events):,}"), ("operators", ", ".join(of.operators) or "none")]
    facts += [(name.replace("_", " "), known[name]) for name in ("stopped_because", "changed_from_python", "program") if name in known]
    return _table("Result", facts)
