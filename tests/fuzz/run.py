"""Build the harnesses with libFuzzer and sanitizers, run each for a while: python tests/fuzz/run.py --seconds 60.

As many run at the same time as there are processors. They start from tests/fuzz/corpus; new inputs go to
build/fuzz/corpus/NAME, crashers to build/fuzz/crash/NAME.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from harnesses import HERE, LENGTHS, NAMES, WITH_MACHINE, build_harness
from wificnc.build.checkout import checkout_root
from wificnc.build.host import VARIANTS
from wificnc.errors import BuildError

SANITIZERS = "address,undefined"
CODE = re.compile(r"^CODE\((\w), *(\d+),", re.M)
SLOWEST_S = 20  # one input
SHOWN = 60  # of a crash
HINT = "Debian, Ubuntu: apt-get install clang libclang-rt-dev"


@dataclass(frozen=True)
class Result:
    """What one run of a harness came to."""

    name: str
    ok: bool
    executions: int
    coverage: int
    corpus: int


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=int, default=60, help="for each harness")
    parser.add_argument("--seed", type=int, default=0, help="of the mutations; 0: another each time")
    parser.add_argument("names", nargs="*", choices=[*NAMES, []], help="default: all")
    asked = parser.parse_args()
    try:
        programs = {name: build(name) for name in asked.names or NAMES}
    except BuildError as err:
        missing = not clang() or "libclang_rt" in str(err)
        print(f"{err}" + (f"\nThe fuzzers need clang with libFuzzer. {HINT}" if missing else ""), file=sys.stderr)
        return 1
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(lambda name: run(name, programs[name], asked.seconds, asked.seed), programs))
    for result in results:
        print(f"fuzz {result.name:12} {'ok' if result.ok else 'FAILED':6} {result.executions:>10} executions, ", end="")
        print(f"{result.coverage} edges, {result.corpus} inputs")
    return 0 if all(result.ok for result in results) else 1


def clang() -> str:
    """$CLANG, or the clang there is, or nothing."""
    return os.environ.get("CLANG") or shutil.which("clang") or ""


def build(name: str) -> Path:
    """One harness with everything it drives, all of it instrumented. Raises BuildError."""
    if not clang():
        raise BuildError("there is no clang here")
    os.environ["CC"] = clang()
    common = ("-O1", "-fno-omit-frame-pointer", "-fno-sanitize-recover=all", f"-fsanitize=fuzzer-no-link,{SANITIZERS}")
    linked = (f"-fsanitize=fuzzer,{SANITIZERS}",)
    # Of a machine in virtual time nearly all comparisons are polls that lead to nothing: to trace them takes two
    # thirds of the time.
    VARIANTS["fuzz"] = (common, linked)
    VARIANTS["fuzz-machine"] = ((*common, "-fno-sanitize-coverage=trace-cmp"), linked)
    variant = "fuzz-machine" if name in WITH_MACHINE else "fuzz"
    return build_harness(name, checkout_root() / "build" / "fuzz" / name, variant)


def dictionary(folder: Path) -> Path:
    """Words that mean something: gcode.dict, and every code that the parser knows."""
    table = (checkout_root() / "core" / "gcode" / "codes.def").read_text()
    codes = [f'"{letter}{int(tenths) / 10:g}"\n' for letter, tenths in CODE.findall(table)]
    path = folder / "gcode.dict"
    staged = folder / f".gcode.dict.{threading.get_ident()}"  # the harnesses run at the same time
    staged.write_text((HERE / "gcode.dict").read_text() + "".join(codes))
    os.replace(staged, path)
    return path


def run(name: str, program: Path, seconds: int, seed: int) -> Result:
    """Run one harness; what it says is shown."""
    folder = program.parent
    grown, crashes = folder / "corpus" / name, folder / "crash" / name
    for path in (grown, crashes):
        path.mkdir(parents=True, exist_ok=True)
    options = [
        f"-max_total_time={seconds}",
        f"-seed={seed}",
        f"-max_len={LENGTHS[name]}",
        f"-timeout={SLOWEST_S}",
        f"-artifact_prefix={crashes}/",
        f"-dict={dictionary(folder)}",
        "-print_final_stats=1",
        "-reload=0",
        *(["-entropic=0"] if name in WITH_MACHINE else []),  # its weights take a quarter of the time there
    ]
    corpora = [grown, HERE / "corpus" / name, HERE / "regressions" / name]
    process = subprocess.Popen(
        [str(program), *options, *(str(path) for path in corpora if path.is_dir())],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    assert process.stdout is not None
    said = []
    for line in process.stdout:
        said.append(line)
        if re.match(r"#\d+\s+(INITED|pulse|DONE)", line):
            print(f"{name}: {line}", end="", flush=True)
    ok = process.wait() == 0
    if not ok:
        print("".join(said[-SHOWN:]), end="")
    return summary(name, ok, "".join(said))


def summary(name: str, ok: bool, said: str) -> Result:
    """The figures of a run from libFuzzer's words."""
    executions = re.findall(r"stat::number_of_executed_units:\s*(\d+)", said) or re.findall(r"^#(\d+)", said, re.M)
    coverage = re.findall(r"\bcov: (\d+)", said)
    corpus = re.findall(r"\bcorp: (\d+)", said)
    return Result(name, ok, *(int(found[-1]) if found else 0 for found in (executions, coverage, corpus)))


if __name__ == "__main__":
    sys.exit(main())
