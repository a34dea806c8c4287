#!/usr/bin/env python3
"""Give each reader inputs that libFuzzer finds by the code that they reach, with every access to memory checked (AddressSanitizer).

With --plain, memory is not checked, and a reader takes up to ten times as many inputs in the same time: our readers are safe Rust, so that the
sanitizer watches the libraries only. Needs a C++ compiler. RUSTC_BOOTSTRAP lets the stable compiler add the instruments; HDF5 itself has none. Failing inputs are kept in
target/fuzz, and what libFuzzer learned in target/fuzz/corpus. Goes on where it was interrupted: target/fuzz/result.json tells which readers
have had how many inputs; those that failed or were interrupted with another build begin anew.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import platform
import re
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
KEPT = ROOT / "target" / "fuzz"
# A folder in memory, for the files that readers read.
MEMORY = pathlib.Path("/dev/shm")
STATE = KEPT / "result.json"
RECORD = ROOT / "tests" / "fuzz" / "result.json"
TRIPLE = f"{platform.machine()}-unknown-linux-gnu"
COVERAGE = ["level=4", "inline-8bit-counters", "pc-table", "trace-compares"]
SANITIZED = ["-Zsanitizer=address"]
FLAGS = ["-Cpasses=sancov-module", *(f"-Cllvm-args=-sanitizer-coverage-{what}" for what in COVERAGE)]
# Longest time for an input, s, also on a busy machine; most memory of an allocation and of the process, MiB, of which the sanitizer takes a part.
LIMITS = ["-timeout=60", "-malloc_limit_mb=1024", "-rss_limit_mb=3072"]
# Leaks are no errors: what ends early leaves what it holds. With short traces of allocations, and few freed blocks that are kept, results take a
# third of the time.
SANITIZER = "detect_leaks=0:malloc_context_size=4:quarantine_size_mb=16"
# Time of a part, s, after which the state is noted and the next reader has its turn.
PART = 300
MOST_FINDINGS = 20


def build(plain):
    """Compile the program with its instruments, without the sanitizer if `plain`; return its path."""
    target = ROOT / "target" / ("guided-plain" if plain else "guided")
    flags = FLAGS if plain else SANITIZED + FLAGS
    command = "cargo build --profile fuzz -p concordem-tests --example fuzz_guided --features libfuzzer --target".split()
    environment = {**os.environ, "RUSTC_BOOTSTRAP": "1", "RUSTFLAGS": " ".join(flags)}
    subprocess.run([*command, TRIPLE, "--target-dir", target], cwd=ROOT, env=environment, check=True)
    return target / TRIPLE / "fuzz" / "examples" / "fuzz_guided"


def read_some(program, reader, inputs, seed):
    """Let a reader read this many inputs, or fewer if the time is over or one fails. Return how many, the edges of the code that they
    reached, and the reason of a failure."""
    corpus = KEPT / "corpus" / reader
    corpus.mkdir(parents=True, exist_ok=True)
    # libFuzzer reads what it learned before first.
    options = [f"-runs={inputs + len(list(corpus.iterdir()))}", f"-max_total_time={PART}", f"-seed={seed}"]
    options += [f"-artifact_prefix={KEPT}/{reader}-", "-print_final_stats=1", *LIMITS]
    # The schedule by entropy counts each rare feature of each input: half of the time, as readers reach some 10,000.
    options.append("-entropic=0")
    chosen = {"CONCORDEM_FUZZ_READER": reader, "CONCORDEM_FUZZ_CORPUS": str(corpus), "ASAN_OPTIONS": SANITIZER}
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        command = [program, corpus, *options, "-detect_leaks=0"]
        environment = {**os.environ, **chosen, "TMPDIR": folder}
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, errors="replace")
    last = lambda pattern: int((re.findall(pattern, ended.stderr, re.MULTILINE) or [0])[-1])
    read = last(r"^(?:#|stat::number_of_executed_units:\s*)(\d+)") - last(r"^#(\d+)\s+INITED")
    reached = last(r"\bcov: (\d+)")
    if ended.returncode == 0:
        return read, reached, None
    reasons = re.findall(r"^.*(?:panicked at|ERROR: ).*(?:\n[^\n=]+)?", ended.stderr, re.MULTILINE)
    kept = re.findall(r"Test unit written to (\S+)", ended.stderr)
    return read, reached, f"{(reasons or [ended.stderr[-400:]])[0]}\n  {' '.join(kept)}"


def lacks(entry, inputs):
    """Whether a reader has not had its inputs, and has not failed too often."""
    return entry["inputs"] < inputs and entry["findings"] < MOST_FINDINGS


def fuzz_part(program, reader, inputs, seed, entry):
    """Give a reader a part of what lacks of its inputs."""
    begun = time.monotonic()
    # Each part has random numbers of its own. Those of 0 would be those of the clock.
    part_seed = (seed * 1_000_003 + entry["inputs"]) % 2**31 + 1
    read, reached, finding = read_some(program, reader, inputs - entry["inputs"], part_seed)
    entry["inputs"] += max(read, 1)
    entry["edges"] = max(entry["edges"], reached)
    entry["seconds"] += round(time.monotonic() - begun)
    if finding:
        entry["findings"] += 1
        print(f"{reader}: {finding}", flush=True)
    print(f"{reader}: {entry['inputs']} inputs, {entry['edges']} edges, {entry['findings']} findings, {entry['seconds']} s", flush=True)


def machine():
    """The processor, and how many cores it has."""
    names = re.findall(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=1_000_000, help="inputs of each reader")
    parser.add_argument("--jobs", type=int, default=1, help="readers at a time")
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers")
    parser.add_argument("--plain", action="store_true", help="without AddressSanitizer")
    parser.add_argument("--record", action="store_true", help=f"write {RECORD}")
    parser.add_argument("readers", nargs="*", help="by default all")
    arguments = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    program = build(arguments.plain)
    known = subprocess.run([program], env={**os.environ, "CONCORDEM_FUZZ_READER": ""}, capture_output=True, text=True).stdout.split()
    if unknown := set(arguments.readers) - set(known):
        sys.exit(f"no reader {', '.join(sorted(unknown))}; choose from: {', '.join(known)}")
    git = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    build_of = hashlib.sha256(program.read_bytes()).hexdigest()[:16]
    at = {"build": build_of, "machine": machine(), "seed": arguments.seed, "sanitizer": not arguments.plain}
    readers = json.loads(STATE.read_text())["readers"] if STATE.exists() else {}
    wanted = arguments.readers or known
    for reader in wanted:
        entry = readers.get(reader, {"inputs": 0, "findings": 0})
        if {key: entry.get(key) for key in at} != at and (entry["findings"] or entry["inputs"] < arguments.inputs):
            readers[reader] = {"commit": git.stdout.strip(), **at, "inputs": 0, "edges": 0, "findings": 0, "seconds": 0}
    lock = threading.Lock()

    def turn(reader):
        fuzz_part(program, reader, arguments.inputs, arguments.seed, readers[reader])
        with lock:
            entries = {name: readers[name] for name in known if name in readers}
            for path in [STATE, *([RECORD] if arguments.record else [])]:
                path.write_text(json.dumps({"readers": entries}, indent=2) + "\n")

    # In turns, so that each reader has had some inputs if there is no time for all.
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        while waiting := [reader for reader in wanted if lacks(readers[reader], arguments.inputs)]:
            list(pool.map(turn, waiting))
    bad = [reader for reader in wanted if readers[reader]["findings"]]
    sys.exit(f"findings in: {', '.join(bad)}; see above" if bad else 0)


if __name__ == "__main__":
    main()
