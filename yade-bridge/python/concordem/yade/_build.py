"""Builds the native plugin for the YADE of this machine: ``python3 -m concordem.yade build``.

The build needs YADE's headers of the same version (from ``YADE_SRC``, else by ``apt-get source``), g++, and the libraries that the
headers include. It does not need Rust: the wheel contains the compiled library.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
from pathlib import Path
from typing import Any, NoReturn

from .._errors import YadeError
from . import _native

#: Compiler definitions for each feature of a YADE build (from YADE's CMakeLists.txt).
DEFINITIONS: dict[str, tuple[str, ...]] = {
    "LOGGER": ("YADE_BOOST_LOG", "BOOST_LOG_DYN_LINK"),
    "COMPLEX_MP": ("YADE_COMPLEX_MP",),
    "MPFR": ("YADE_MPFR",),
    "VTK": ("YADE_VTK",),
    "OPENMP": ("YADE_OPENMP",),
    "GTS": ("YADE_GTS",),
    "QT5": ("YADE_OPENGL", "YADE_QT5", "QT_NO_KEYWORDS"),
    "CGAL": ("YADE_CGAL", "CGAL_DISABLE_ROUNDING_MATH_CHECK"),
    "PFVFLOW": ("FLOW_ENGINE",),
    "LINSOLV": ("LINSOLV",),
    "MPI": ("YADE_MPI",),
    "TWOPHASEFLOW": ("TWOPHASEFLOW",),
    "SPH": ("YADE_SPH",),
    "LS_DEM": ("YADE_LS_DEM",),
    "DEFORM": ("YADE_DEFORM",),
    "FEMLIKE": ("YADE_FEM",),
    "LIQMIGRATION": ("YADE_LIQMIGRATION",),
    "GL2PS": ("YADE_GL2PS",),
    "LBMFLOW": ("LBM_ENGINE",),
    "THERMAL": ("THERMAL",),
    "PARTIALSAT": ("PARTIALSAT",),
    "PROFILING": ("USE_TIMING_DELTAS", "ISC_TIMING"),
    "POTENTIAL_PARTICLES": ("YADE_POTENTIAL_PARTICLES",),
    "POTENTIAL_BLOCKS": ("YADE_POTENTIAL_BLOCKS",),
}
#: Features that do not affect headers.
SILENT = {"USEFUL_ERRORS", "MPC", "ENABLE_POTENTIAL_BLOCKS"}
#: Definitions of every build with 64-bit reals.
ALWAYS = (
    "YADE_REAL_BIT=64",
    "YADE_REAL_DEC=15",
    "YADE_ODEINT",
    "MAX_LOG_LEVEL=5",
    "EIGEN_DONT_VECTORIZE",
    "EIGEN_DONT_ALIGN",
    "EIGEN_DISABLE_UNALIGNED_ARRAY_ASSERT",
)
#: Headers outside YADE's tree, with the Debian packages that have them.
NEEDED = {
    "boost/version.hpp": "libboost-dev",
    "boost/python.hpp": "libboost-python-dev",
    "boost/log/core.hpp": "libboost-log-dev",
    "boost/serialization/access.hpp": "libboost-serialization-dev",
    "boost/iostreams/filtering_stream.hpp": "libboost-iostreams-dev",
    "eigen3/Eigen/Core": "libeigen3-dev",
}


def fail(message: str, kind: str) -> NoReturn:
    """Raise YadeError."""
    raise YadeError(message, kind)


def installed(yade: str) -> dict[str, Any]:
    """Facts about the YADE that the command `yade` starts."""
    script = "import json\nfrom concordem.yade import _native\nprint('FACTS ' + json.dumps(_native.facts()))\n"
    text = inside(yade, script)
    for line in text.splitlines():
        if line.startswith("FACTS "):
            found: dict[str, Any] = json.loads(line[6:])
            return found
    fail(f"`{yade}` started, but did not report its version; check that it is YADE. Its last output:\n{text[-2000:]}", "NoYade")


def inside(yade: str, script: str) -> str:
    """Run a script that imports this package in YADE; return its output."""
    if shutil.which(yade) is None:
        fail(f"there is no program `{yade}`; install it (Debian: apt install yade), or give its name: build --yade PROGRAM", "NoYade")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ask.py"
        file.write_text(script)
        paths = [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in paths if p)}
        done = subprocess.run(
            [yade, "-n", "-x", "-j1", str(file)], capture_output=True, text=True, env=environment, timeout=600, check=False
        )
    return done.stdout + done.stderr


def cache_folder() -> Path:
    """Folder of what can be made again: YADE's headers, compiled shims."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "concordem"


def version_of(tree: Path) -> str | None:
    """Version of a source tree; None if it has no file RELEASE."""
    release = tree / "RELEASE"
    return release.read_text().strip() if release.is_file() else None


def headers(version: str, log: Any = print) -> Path:
    """Source tree of this version of YADE."""
    given = os.environ.get("YADE_SRC")
    if given:
        tree = Path(given)
        if not (tree / "core/Scene.hpp").is_file():
            fail(f"YADE_SRC is {given}, which has no core/Scene.hpp; give the root of YADE's sources", "NoHeaders")
        return check_version(tree, version, f"YADE_SRC ({given})")
    cache = cache_folder() / f"yade-{version}"
    if not (cache / "core/Scene.hpp").is_file():
        fetch(version, cache, log)
    return check_version(cache, version, str(cache))


def check_version(tree: Path, version: str, what: str) -> Path:
    """The tree; raises YadeError unless it has this version."""
    found = version_of(tree)
    if found is not None and found != version:
        fail(f"{what} contains YADE {found}, but {version} is installed; get the headers of that version", "WrongVersion")
    if found is None:
        fail(f"{what} has no file RELEASE, so its version is unknown; get the complete sources of {version}", "WrongVersion")
    return tree


def fetch(version: str, to: Path, log: Any) -> None:
    """Download YADE's sources with apt and extract the headers to `to`."""
    remedy = (
        f"get the sources of YADE {version} (its release at https://gitlab.com/yade-dev/trunk, or Debian's "
        f"yade_{version}.orig.tar) and give their folder: YADE_SRC=<folder> python3 -m concordem.yade build"
    )
    if shutil.which("apt-get") is None:
        fail(f"apt-get, which fetches YADE's headers, is missing; {remedy}", "NoHeaders")
    package = subprocess.run(["dpkg-query", "-W", "-f", "${source:Version}", "yade"], capture_output=True, text=True, check=False)
    if package.returncode:
        fail(f"YADE was not installed by apt, so apt cannot fetch its sources; {remedy}", "NoHeaders")
    log(f"fetching the sources of yade {package.stdout} with apt-get source")
    with tempfile.TemporaryDirectory() as folder:
        # Only the upstream archive, because mirrors delete the other parts earlier.
        command = ["apt-get", "source", "--download-only", "--tar-only", "-qq", f"yade={package.stdout}"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        archives = sorted(Path(folder).glob("*.orig.tar.*"))
        if done.returncode or not archives:
            reason = (done.stderr or done.stdout).strip().splitlines()
            fail(f"apt-get source yade={package.stdout} failed ({reason[-1] if reason else 'no archive was downloaded'}); {remedy}", "NoHeaders")
        unpack(archives[0], to)


def unpack(archive: Path, to: Path) -> None:
    """Extract the headers of a source archive to `to`, atomically."""
    partial = to.with_name(to.name + ".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    with tarfile.open(archive) as tar:
        for member in tar:
            parts = Path(member.name).parts[1:]
            wanted = member.isfile() and parts and (member.name.endswith((".hpp", ".h", ".ipp")) or parts == ("RELEASE",))
            if not wanted or ".." in parts:
                continue
            source = tar.extractfile(member)
            if source is None:
                continue
            file = partial.joinpath(*parts)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(source.read())
    if not (partial / "core/Scene.hpp").is_file():
        fail(f"{archive.name} has no core/Scene.hpp, so it is not an archive of YADE", "NoHeaders")
    shutil.rmtree(to, ignore_errors=True)
    partial.rename(to)


def definitions(found: dict[str, Any]) -> list[str]:
    """Compiler definitions of this YADE build."""
    if found["bits"] != 64:
        fail(f"this YADE uses {found['bits']}-bit reals; the plugin supports double precision only", "Precision")
    unknown = [name for name in found["features"] if name not in DEFINITIONS and name not in SILENT]
    if unknown:
        fail(f"YADE has features {unknown}, which the plugin does not support; use a YADE without them", "Features")
    names = list(ALWAYS)
    for feature in found["features"]:
        names += DEFINITIONS.get(feature, ())
    return [f"-D{name}" for name in names]


def include_folders(compiler: str, found: dict[str, Any]) -> list[str]:
    """Compiler flags for the headers of other libraries. Raises YadeError with the packages of missing ones."""
    system = [Path("/usr/include")]
    missing = sorted({package for header, package in NEEDED.items() if not any((root / header).is_file() for root in system)})
    python = sysconfig.get_path("include")
    wanted = f"/usr/include/python{found['python']}"
    if "%d.%d" % sys.version_info[:2] != found["python"] or not (Path(python) / "Python.h").is_file():
        python = wanted
    if not (Path(python) / "Python.h").is_file():
        missing.append("python3-dev")
    flags = ["-isystem", python, "-isystem", "/usr/include/eigen3"]
    if "MPI" in found["features"]:
        asked = subprocess.run(["mpicxx", "--showme:compile"], capture_output=True, text=True, check=False) if shutil.which("mpicxx") else None
        if asked is None or asked.returncode:
            missing.append("libopenmpi-dev")
        else:
            flags += asked.stdout.split()
    if "CGAL" in found["features"] and not Path("/usr/include/CGAL/version.h").is_file():
        missing.append("libcgal-dev")
    if "MPFR" in found["features"]:
        missing += [name for header, name in (("mpfr.h", "libmpfr-dev"), ("mpc.h", "libmpc-dev")) if not header_exists(compiler, header)]
    if shutil.which(compiler) is None:
        missing.insert(0, "g++")
    if missing:
        fail(f"packages are missing; install them with: apt install {' '.join(missing)}", "MissingPackages")
    return flags


def header_exists(compiler: str, header: str) -> bool:
    """Whether the compiler finds a header."""
    if shutil.which(compiler) is None:
        return True
    done = subprocess.run([compiler, "-E", "-x", "c++", "-"], input=f"#include <{header}>\n", capture_output=True, text=True, check=False)
    return done.returncode == 0


def check_compiler(compiler: str, found: dict[str, Any]) -> None:
    """Raise YadeError unless compiler and boost match those of YADE, because both determine the layout of classes."""
    text = '#include <boost/version.hpp>\nBOOST BOOST_LIB_VERSION GCC __GNUC__\n'
    done = subprocess.run([compiler, "-E", "-P", "-x", "c++", "-"], input=text, capture_output=True, text=True, check=False)
    match = re.search(r'BOOST "(\d+)_(\d+)(?:_(\d+))?" GCC (\d+)', done.stdout)
    if match is None:
        fail(f"{compiler} cannot preprocess boost/version.hpp:\n{done.stderr[-1000:]}", "Compiler")
    boost, gcc = ".".join(part or "0" for part in match.groups()[:3]), match.group(4)
    if found["boost"] and found["boost"] != boost:
        fail(f"YADE was built with boost {found['boost']}, but the installed headers are {boost}; install those of {found['boost']}", "Compiler")
    made = re.search(r"gcc (\d+)", found["compiler"])
    if made and made.group(1) != gcc:
        fail(f"YADE was built with {found['compiler']}, but {compiler} is version {gcc}; give the right one: build --compiler g++-{made.group(1)}", "Compiler")


#: Compiled shims that the cache keeps.
KEPT = 4


def identity(compiler: str) -> bytes:
    """Hash of the programs that turn preprocessed source into an object: driver, compiler, assembler."""
    found = hashlib.sha256()
    for name in ("", "cc1plus", "as"):
        program = compiler
        if name:
            asked = subprocess.run([compiler, f"-print-prog-name={name}"], capture_output=True, text=True, check=False)
            program = asked.stdout.strip()
        path = shutil.which(program)
        found.update(f"{program} {path}\n".encode())
        if path:
            found.update(Path(path).read_bytes())
    return found.digest()


def object_file(compiler: str, flags: list[str], unit: Path, names: str, log: Any) -> Path:
    """The object of a unit, compiled beside it or from the cache.

    An object depends on the preprocessed source, which contains every header, on the flags, and on the compiler. Their hash is its name in
    the cache. The library is not part of it: another library is linked with the same object.
    """
    folder, whole = unit.parent, unit.with_suffix(".ii")
    # Relative names, because the preprocessor writes them to its output.
    done = subprocess.run([compiler, *flags, "-E", unit.name, "-o", whole.name], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        fail(f"the plugin does not compile:\n{done.stderr[-4000:]}", "Compiler")
    found = hashlib.sha256(identity(compiler))
    found.update(json.dumps(flags).encode())
    found.update(whole.read_bytes())
    kept = cache_folder() / f"yade-shim-{found.hexdigest()[:32]}.o"
    if kept.is_file():
        log(f"{names} have not changed since they were compiled ({kept})")
        os.utime(kept)
        return kept
    log(f"compiling {names} (some minutes)")
    compiled = unit.with_suffix(".o")
    # What was hashed is what is compiled.
    done = subprocess.run([compiler, *flags, "-c", whole.name, "-o", compiled.name], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        fail(f"the plugin does not compile:\n{done.stdout[-2000:]}{done.stderr[-4000:]}", "Compiler")
    keep(compiled, kept)
    return compiled


def keep(compiled: Path, kept: Path) -> None:
    """Copy an object to the cache, atomically, and delete the objects that were not used for longest. A cache that cannot be written is
    no error."""
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=kept.parent, delete=False) as partial:
            partial.write(compiled.read_bytes())
        os.replace(partial.name, kept)
        for old in sorted(kept.parent.glob("yade-shim-*.o"), key=lambda file: file.stat().st_mtime)[:-KEPT]:
            old.unlink(missing_ok=True)
    except OSError:
        pass


def build(yade: str = "yade", compiler: str = "g++", log: Any = print) -> Path:
    """Compile the plugin for a YADE and check it there; return its path."""
    parts = _native.staged()
    library = parts / "libconcordem_yade.a"
    sources = sorted(parts.glob("*.cpp"))
    if not library.is_file() or not sources:
        fail(
            f"this installation lacks the native parts ({parts} is missing or empty); build the wheel with `make wheel`, not with "
            "maturin alone or from the source package, and install it",
            "NothingStaged",
        )
    found = installed(yade)
    log(f"YADE {found['version']} ({found['compiler']}, boost {found['boost']}), features {' '.join(found['features'])}")
    defined = definitions(found)
    flags = include_folders(compiler, found)
    check_compiler(compiler, found)
    tree = headers(found["version"], log)
    target = _native.place(found)
    target.parent.mkdir(parents=True, exist_ok=True)
    # -O2 without fused operations, as in Debian's packages, because results must be bitwise equal.
    common = ["-std=c++17", "-O1", "-fPIC", "-fopenmp", "-ffp-contract=off", "-w", *defined, "-isystem", str(tree), *flags, "-I", str(parts)]
    if "CGAL" in found["features"]:
        common.append("-frounding-math")
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        # One unit: most of the time goes into YADE's own headers, which each unit would read again.
        unit = Path(folder) / "unit.cpp"
        unit.write_text("".join(f'#include "{source.name}"\n' for source in sources))
        compiled = object_file(compiler, common, unit, ", ".join(source.name for source in sources), log)
        made = Path(folder) / "plugin.so"
        # Hide the library's symbols, but not those of the shim's C++ classes, which boost::serialization needs.
        command = [compiler, "-shared", "-fopenmp", "-o", str(made), str(compiled), str(library)]
        command += ["-Wl,--exclude-libs,libconcordem_yade.a", "-Wl,--gc-sections", "-lpthread", "-ldl", "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            fail(f"the plugin cannot be linked:\n{done.stderr[-4000:]}", "Compiler")
        log("comparing its layout with YADE's")
        words_of_yade = inside(yade, TEST.format(path=str(made)))
        if "\nPLUGIN FITS" not in words_of_yade:
            fail(f"the plugin was built, but does not match this YADE and was deleted:\n{words_of_yade[-3000:]}", "Layout")
        os.replace(made, target)
    log(f"built {target}")
    return target


TEST = """
from pathlib import Path
from concordem.yade import _native
_native.load(Path({path!r}))
print("\\nPLUGIN FITS")
"""


def check(yade: str, script: str) -> int:
    """Print what :func:`concordem.yade.doctor` finds in a script; 1 if something is refused or unknown."""
    if not os.path.isfile(script):
        print(f"error: there is no file {script}", file=sys.stderr)
        return 1
    mark = "concordem found: "
    asked = f"import concordem.yade\nfor found in concordem.yade.doctor({os.path.abspath(script)!r}, quiet=True):\n    print({mark!r} + str(found))\nprint({mark!r} + 'end')\n"
    words = inside(yade, asked)
    found = [line[len(mark) :] for line in words.splitlines() if line.startswith(mark)]
    if not found:
        print(f"error: {yade} did not answer:\n{words}", file=sys.stderr)
        return 1
    for line in found[:-1]:
        print(f"{script}: {line}")
    wrong = [line for line in found if ": refused: " in line or ": unknown: " in line]
    print(f"{script}: {len(wrong)} of {len(found) - 1} remarks are refused or unknown")
    return 1 if wrong else 0


def main(arguments: list[str]) -> int:
    """Run the command line."""
    import argparse

    parser = argparse.ArgumentParser(prog="python3 -m concordem.yade", description="ConcorDEM in YADE")
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("build", help="build the native plugin for the YADE of this machine", description=__doc__)
    one.add_argument("--yade", default=os.environ.get("YADE", "yade"), help="the program (default: yade)")
    one.add_argument("--compiler", default=os.environ.get("CXX", "g++"), help="default: g++")
    two = commands.add_parser("check", help="say what a bonded engine follows and refuses in a script of YADE, without running it")
    two.add_argument("script", help="the script")
    two.add_argument("--yade", default=os.environ.get("YADE", "yade"), help="the program (default: yade)")
    options = parser.parse_args(arguments)
    if options.command == "check":
        return check(options.yade, options.script)
    try:
        build(options.yade, options.compiler)
    except YadeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0
