#!/usr/bin/env python3
"""Runs the code of Markdown pages as a reader would: in one empty folder for each page, one block after another.

    python3 tests/docs/run_blocks.py [--program build/release/trocar] [--python build/release/python] PAGE...

A comment before a fenced block says what it is:

    <!-- run -->             it runs (bash or python), and must end well
    <!-- run: exit 2 -->     it must end with that code
    <!-- file: NAME -->      it is written to that file
    <!-- prints -->          every line of it stands in what the last block printed; "..." stands for anything

The folder has `assets`, as a reader's working folder has.
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BLOCK = re.compile(r"^<!-- (run|file|prints)(?:: ?([^>]*?))? -->\n+```(\w*)\n(.*?)^```$", re.S | re.M)


def expected(line):
    return re.compile(".*?".join(re.escape(part) for part in line.split("...")).join(("^ *", " *$")))


def run_page(page, program, python):
    text = page.read_text()
    environment = dict(os.environ, PATH=f"{program.parent}{os.pathsep}{os.environ['PATH']}", TROCAR_PROGRAM=str(program), PYTHONDONTWRITEBYTECODE="1",
                       PYTHONPATH=os.pathsep.join([str(python), str(ROOT / "tests/python/stand_in")]))
    printed, problems, blocks = "", [], 0
    with tempfile.TemporaryDirectory(prefix="trocar-docs-") as folder:
        os.symlink(ROOT / "assets", pathlib.Path(folder) / "assets")
        for found in BLOCK.finditer(text):
            what, detail, language, body = found.groups()
            where = f"{page.name}:{text.count(chr(10), 0, found.start()) + 1}"
            blocks += 1
            if what == "file":
                (pathlib.Path(folder) / detail).write_text(body)
            elif what == "prints":
                lines = printed.splitlines()
                for line in filter(str.strip, body.splitlines()):
                    if not any(expected(line.strip()).match(one) for one in lines):
                        problems.append(f"{where}: not printed: {line}\n" + "\n".join("    | " + one for one in lines[-12:]))
            else:
                command = ["bash", "-euc", body] if language in ("bash", "") else ["/usr/bin/python3", "-c", body]
                ended = subprocess.run(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=540)
                printed = ended.stdout + ended.stderr
                wanted = int(detail.split()[1]) if detail else 0
                if ended.returncode != wanted:
                    problems.append(f"{where}: exit code {ended.returncode}, expected {wanted}\n" + "\n".join("    | " + one for one in printed.splitlines()[-20:]))
                    break  # what follows needs it
    return blocks, problems


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/release/trocar")
    parser.add_argument("--python", type=pathlib.Path, default=ROOT / "build/release/python", help="folder that holds the Python package")
    parser.add_argument("pages", nargs="+", type=pathlib.Path)
    options = parser.parse_args()
    failed = False
    for page in options.pages:
        blocks, problems = run_page(page, options.program.resolve(), options.python.resolve())
        if blocks == 0:
            problems.append(f"{page}: no block is marked")
        print(f"{page.name}: {blocks} blocks, {len(problems)} problems")
        for problem in problems:
            print(problem)
        failed = failed or bool(problems)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
