"""Builds the native plugin for the YADE of this machine: ``python3 -m concordem.yade build``.

Needed: YADE's headers of the same version (from ``YADE_SRC``, else ``apt-get source``), g++, and the libraries that the headers
include. No Rust: the wheel carries the compiled library.
"""

from __future__ import annotations

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

#: What each feature that YADE was configured with adds to the compiler's definitions (YADE's CMakeLists.txt).
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
#: Features that change no header.
SILENT = {"USEFUL_ERRORS", "MPC", "ENABLE_POTENTIAL_BLOCKS"}
#: Definitions of every build with reals of 64 bits.
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
    """Stop, with what to do."""
    raise YadeError(message, kind)


def installed(yade: str) -> dict[str, Any]:
    """Facts of the YADE that a command starts."""
    script = "import json\nfrom concordem.yade import _native\nprint('FACTS ' + json.dumps(_native.facts()))\n"
    text = inside(yade, script)
    for line in text.splitlines():
        if line.startswith("FACTS "):
            found: dict[str, Any] = json.loads(line[6:])
            return found
    fail(f"`{yade}` started, but did not tell what it is. Its last words:\n{text[-2000:]}", "NoYade")


def inside(yade: str, script: str) -> str:
    """What YADE prints when it runs a script that can import this package."""
    if shutil.which(yade) is None:
        fail(f"there is no program `{yade}`; install it (Debian: apt install yade), or name it: build --yade PROGRAM", "NoYade")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ask.py"
        file.write_text(script)
        paths = [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in paths if p)}
        done = subprocess.run(
            [yade, "-n", "-x", "-j1", str(file)], capture_output=True, text=True, env=environment, timeout=600, check=False
        )
    return done.stdout + done.stderr


def version_of(tree: Path) -> str | None:
    """Version that a source tree says it has."""
    release = tree / "RELEASE"
    return release.read_text().strip() if release.is_file() else None


def headers(version: str, log: Any = print) -> Path:
    """A source tree of this version of YADE."""
    given = os.environ.get("YADE_SRC")
    if given:
        tree = Path(given)
        if not (tree / "core/Scene.hpp").is_file():
            fail(f"YADE_SRC is {given}, but there is no core/Scene.hpp in it; it must be the root of YADE's sources", "NoHeaders")
        return check_version(tree, version, f"YADE_SRC ({given})")
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "concordem" / f"yade-{version}"
    if not (cache / "core/Scene.hpp").is_file():
        fetch(version, cache, log)
    return check_version(cache, version, str(cache))


def check_version(tree: Path, version: str, what: str) -> Path:
    """The tree, if it is of that version."""
    found = version_of(tree)
    if found is not None and found != version:
        fail(f"{what} holds YADE {found}, but {version} is installed; headers of exactly that version are needed", "WrongVersion")
    if found is None:
        fail(f"{what} has no file RELEASE, so its version is unknown; {version} is needed", "WrongVersion")
    return tree


def fetch(version: str, to: Path, log: Any) -> None:
    """YADE's sources by apt, as far as headers go."""
    remedy = (
        f"get the sources of YADE {version} (its release at https://gitlab.com/yade-dev/trunk, or Debian's "
        f"yade_{version}.orig.tar) and say where they are: YADE_SRC=<folder> python3 -m concordem.yade build"
    )
    if shutil.which("apt-get") is None:
        fail(f"there is no apt-get to fetch YADE's headers with; {remedy}", "NoHeaders")
    package = subprocess.run(["dpkg-query", "-W", "-f", "${source:Version}", "yade"], capture_output=True, text=True, check=False)
    if package.returncode:
        fail(f"YADE was not installed by apt, so apt has no sources of it; {remedy}", "NoHeaders")
    log(f"fetching the sources of yade {package.stdout} with apt-get source")
    with tempfile.TemporaryDirectory() as folder:
        # The archive of upstream's sources alone: mirrors lose the other parts sooner.
        command = ["apt-get", "source", "--download-only", "--tar-only", "-qq", f"yade={package.stdout}"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        archives = sorted(Path(folder).glob("*.orig.tar.*"))
        if done.returncode or not archives:
            reason = (done.stderr or done.stdout).strip().splitlines()
            fail(f"apt-get source yade={package.stdout} failed ({reason[-1] if reason else 'no archive came'}); {remedy}", "NoHeaders")
        unpack(archives[0], to)


def unpack(archive: Path, to: Path) -> None:
    """Headers of an archive of sources, into `to` as a whole or not at all."""
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
        fail(f"{archive.name} has no core/Scene.hpp", "NoHeaders")
    shutil.rmtree(to, ignore_errors=True)
    partial.rename(to)


def definitions(found: dict[str, Any]) -> list[str]:
    """The compiler's definitions with which that YADE was made."""
    if found["bits"] != 64:
        fail(f"this YADE computes with reals of {found['bits']} bits; the plugin is made for double precision", "Precision")
    unknown = [name for name in found["features"] if name not in DEFINITIONS and name not in SILENT]
    if unknown:
        fail(f"YADE has features {unknown} whose effect on its classes is not known here; no plugin is built for it", "Features")
    names = list(ALWAYS)
    for feature in found["features"]:
        names += DEFINITIONS.get(feature, ())
    return [f"-D{name}" for name in names]


def include_folders(compiler: str, found: dict[str, Any]) -> list[str]:
    """Folders with the headers of other libraries; what is missing is named with its package."""
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
        fail(f"to build the plugin these packages are needed: apt install {' '.join(missing)}", "MissingPackages")
    return flags


def header_exists(compiler: str, header: str) -> bool:
    """Whether the compiler finds a header."""
    if shutil.which(compiler) is None:
        return True
    done = subprocess.run([compiler, "-E", "-x", "c++", "-"], input=f"#include <{header}>\n", capture_output=True, text=True, check=False)
    return done.returncode == 0


def check_compiler(compiler: str, found: dict[str, Any]) -> None:
    """The compiler and boost must be those YADE was made with: both decide about the layout of classes."""
    text = '#include <boost/version.hpp>\nBOOST BOOST_LIB_VERSION GCC __GNUC__\n'
    done = subprocess.run([compiler, "-E", "-P", "-x", "c++", "-"], input=text, capture_output=True, text=True, check=False)
    match = re.search(r'BOOST "(\d+)_(\d+)(?:_(\d+))?" GCC (\d+)', done.stdout)
    if match is None:
        fail(f"{compiler} does not tell its version:\n{done.stderr[-1000:]}", "Compiler")
    boost, gcc = ".".join(part or "0" for part in match.groups()[:3]), match.group(4)
    if found["boost"] and found["boost"] != boost:
        fail(f"YADE was made with boost {found['boost']}; the headers here are of {boost}", "Compiler")
    made = re.search(r"gcc (\d+)", found["compiler"])
    if made and made.group(1) != gcc:
        fail(f"YADE was made with {found['compiler']}; {compiler} is version {gcc}. Name the right one: build --compiler g++-{made.group(1)}", "Compiler")


def build(yade: str = "yade", compiler: str = "g++", log: Any = print) -> Path:
    """Compile the plugin for a YADE, and test it there; where it is."""
    parts = _native.staged()
    library = parts / "libconcordem_yade.a"
    sources = sorted(parts.glob("*.cpp"))
    if not library.is_file() or not sources:
        fail(f"this installation carries nothing to build the plugin from ({parts} is missing or empty)", "NothingStaged")
    found = installed(yade)
    log(f"YADE {found['version']} ({found['compiler']}, boost {found['boost']}), features {' '.join(found['features'])}")
    defined = definitions(found)
    flags = include_folders(compiler, found)
    check_compiler(compiler, found)
    tree = headers(found["version"], log)
    target = _native.place(found)
    target.parent.mkdir(parents=True, exist_ok=True)
    # -O2 without fused operations, as Debian's packages: bits depend on it.
    common = ["-std=c++17", "-O2", "-fPIC", "-fopenmp", "-ffp-contract=off", "-w", *defined, "-isystem", str(tree), *flags, "-I", str(parts)]
    if "CGAL" in found["features"]:
        common.append("-frounding-math")
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        # One unit: most of the time goes into YADE's own headers, which each unit would read again.
        unit, compiled = Path(folder) / "unit.cpp", Path(folder) / "unit.o"
        unit.write_text("".join(f'#include "{source.name}"\n' for source in sources))
        log(f"compiling {', '.join(source.name for source in sources)} (some minutes)")
        done = subprocess.run([compiler, *common, "-c", str(unit), "-o", str(compiled)], capture_output=True, text=True, check=False)
        if done.returncode:
            fail(f"the plugin does not compile against the headers in {tree}:\n{done.stdout[-2000:]}{done.stderr[-4000:]}", "Compiler")
        made = Path(folder) / "plugin.so"
        # The library's own symbols stay inside; those of the shim's C++ classes must be seen by boost::serialization.
        command = [compiler, "-shared", "-fopenmp", "-o", str(made), str(compiled), str(library)]
        command += ["-Wl,--exclude-libs,libconcordem_yade.a", "-Wl,--gc-sections", "-lpthread", "-ldl", "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            fail(f"the plugin cannot be linked:\n{done.stderr[-4000:]}", "Compiler")
        log("comparing its layout with YADE's")
        words_of_yade = inside(yade, TEST.format(path=str(made)))
        if "\nPLUGIN FITS" not in words_of_yade:
            fail(f"the plugin was built, but does not fit and was thrown away:\n{words_of_yade[-3000:]}", "Layout")
        os.replace(made, target)
    log(f"built {target}")
    return target


TEST = """
from pathlib import Path
from concordem.yade import _native
_native.load(Path({path!r}))
print("\\nPLUGIN FITS")
"""


def main(arguments: list[str]) -> int:
    """The command line."""
    import argparse

    parser = argparse.ArgumentParser(prog="python3 -m concordem.yade", description="ConcorDEM in YADE")
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("build", help="build the native plugin for the YADE of this machine", description=__doc__)
    one.add_argument("--yade", default=os.environ.get("YADE", "yade"), help="the program (default: yade)")
    one.add_argument("--compiler", default=os.environ.get("CXX", "g++"), help="default: g++")
    options = parser.parse_args(arguments)
    try:
        build(options.yade, options.compiler)
    except YadeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0
