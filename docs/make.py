#!/usr/bin/env python3
"""Writes the generated pages of docs/ anew, or with --check says which are stale.

    python3 docs/make.py [--check] [--program build/release/trocar]

Of the program: commands.md, outputs.md, scene.md, sweep.md, the schemas, and the tables of benchmarks.md from docs/measured. Of the sources: python_reference.md, cpp_reference.md, the diagram of a step in
architecture.md.
"""

import argparse
import ast
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"

# ---------------------------------------------------------------- Python

PYTHON_INTRO = """# Python reference

Names, signatures and docstrings of the package `trocar`; written by `python3 docs/make.py` from its sources. How they go together:
[python.md](python.md), and the tutorial [train and score a policy](tutorial_policy.md). Arrays are float64 and SI where nothing else is said.
"""


def plain(node):
    text = ast.unparse(node)
    for long, short in (("Optional[", "Optional["), ("NDArray[np.float64]", "array"), ("NDArray[np.float32]", "float32 array"), ("NDArray[np.uint32]", "uint32 array"),
                        ("NDArray[Any]", "array"), ("NDArray[np.uint8]", "uint8 array"), ("'os.PathLike[str]'", "PathLike"), ("_engine.", "")):
        text = text.replace(long, short)
    return text


def signature(function, name=None, skip_self=False):
    args = function.args
    parts = []
    positional = args.posonlyargs + args.args
    defaults = [None] * (len(positional) - len(args.defaults)) + list(args.defaults)
    for arg, default in list(zip(positional, defaults))[1 if skip_self else 0:]:
        parts.append(arg.arg + (f"={plain(default)}" if default is not None else ""))
    if args.kwonlyargs:
        parts.append("*")
        for arg, default in zip(args.kwonlyargs, args.kw_defaults):
            parts.append(arg.arg + (f"={plain(default)}" if default is not None else ""))
    returns = f" -> {plain(function.returns)}" if function.returns is not None else ""
    return f"{name or function.name}({', '.join(parts)}){returns}"


def docstring(node):
    return ast.get_docstring(node) or ""


def block(text):
    """The first paragraph as text, what is laid out in columns as it stands."""
    paragraphs = text.split("\n\n")
    out = [paragraphs[0].replace("\n", " ")]
    for paragraph in paragraphs[1:]:
        out.append("```text\n" + paragraph + "\n```" if re.search(r"\S {2,}\S", paragraph) or paragraph.startswith(" ") else paragraph.replace("\n", " "))
    return "\n\n".join(p for p in out if p)


def fields_of(cls, lines):
    rows = []
    for node in cls.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and not node.target.id.startswith("_"):
            line = lines[node.end_lineno - 1]
            meaning = line.split("#:", 1)[1].strip() if "#:" in line else ""
            default = f"`{plain(node.value)}`" if node.value is not None else ""
            rows.append(f"| `{node.target.id}` | {default} | {meaning} |")
    return rows


def class_page(cls, lines):
    page = f"\n## {cls.name}\n\n{block(docstring(cls))}\n"
    rows = fields_of(cls, lines)
    if rows:
        page += "\n| field | default | meaning |\n| --- | --- | --- |\n" + "\n".join(rows) + "\n"
    properties, methods = [], []
    for node in cls.body:
        if not isinstance(node, ast.FunctionDef) or (node.name.startswith("_") and node.name != "__init__"):
            continue
        is_property = any(isinstance(d, ast.Name) and d.id in ("property", "cached_property") for d in node.decorator_list)
        if is_property:
            kind = plain(node.returns).replace("|", "\\|") if node.returns is not None else ""
            properties.append(f"| `{node.name}` | `{kind}` | {docstring(node).replace(chr(10), ' ')} |")
        elif node.name == "__init__":
            methods.insert(0, f"\n`{signature(node, cls.name, True).split(' -> ')[0]}`\n")
        else:
            methods.append(f"\n`.{signature(node, skip_self=True)}`\n\n{block(docstring(node))}\n")
    if properties:
        page += "\n| property | type | meaning |\n| --- | --- | --- |\n" + "\n".join(properties) + "\n"
    return page + "".join(methods)


def python_reference():
    package = ROOT / "python" / "trocar"
    files = {}
    for file in sorted(package.glob("*.py")) + [package / "_engine.pyi"]:
        text = file.read_text()
        files[file.name] = (ast.parse(text), text.splitlines())
    init = files["__init__.py"][0]
    public, origin = [], {}
    for node in init.body:
        if isinstance(node, ast.Assign) and node.targets[0].id == "__all__":
            public = [e.value for e in node.value.elts]
        if isinstance(node, ast.ImportFrom) and node.module:
            for name in node.names:
                origin[name.name] = node.module
    page = PYTHON_INTRO
    functions, classes = "", ""
    for name in sorted(public, key=str.lower):
        module = origin[name]
        tree, lines = files[module + (".pyi" if module == "_engine" else ".py")]
        node = next(n for n in tree.body if getattr(n, "name", None) == name)
        if isinstance(node, ast.ClassDef):
            classes += class_page(node, lines)
        else:
            functions += f"\n### {name}\n\n`trocar.{signature(node)}`\n\n{block(docstring(node))}\n"
    page += "\n## Functions\n" + functions + classes
    for module in ("gym", "anatomy"):
        tree, lines = files[module + ".py"]
        page += f"\n## trocar.{module}\n\n{block(docstring(tree))}\n"
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                page += f"\n### {module}.{node.name}\n\n`trocar.{module}.{signature(node)}`\n\n{block(docstring(node))}\n"
            elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                page += class_page(node, lines).replace(f"\n## {node.name}", f"\n### {module}.{node.name}", 1)
    return page


# ---------------------------------------------------------------- C++

CPP_INTRO = """# C++ reference

What `#include <trocar.hpp>` gives after `cmake --install`, header by header; written by `python3 docs/make.py` from their comments. Names are in
`trocar::engine`, meshes and results in `trocar`. Examples: [examples/](../examples); how an effect or a solver of your own goes in:
[extending.md](extending.md).

From C: [c_api.md](c_api.md).
"""


def public_headers():
    found, waiting = [], ["engine/trocar.hpp"]
    while waiting:
        header = waiting.pop(0)
        if header in found or not (ROOT / header).exists():
            continue
        found.append(header)
        waiting += re.findall(r'^#include "([^"]+)"', (ROOT / header).read_text(), re.M)
    return sorted(found)


def declaration_after(lines, at):
    """The declaration that starts at a line: up to its body or semicolon."""
    text = ""
    for line in lines[at:at + 12]:
        text += (" " if text else "") + line.strip()
        if re.search(r"[;{]\s*(//.*)?$", line):
            break
    text = re.sub(r"\s*//.*$", "", text)
    text = text.replace("[[nodiscard]] ", "")
    return re.sub(r"\s*(\{.*)?;?$", "", text)


def cpp_reference():
    page = CPP_INTRO
    for header in public_headers():
        lines = (ROOT / header).read_text().splitlines()
        intro = []
        for line in lines:
            if not line.startswith("//"):
                break
            intro.append(line[2:].strip())
        paragraphs = " ".join(intro)
        page += f"\n## {header}\n\n{paragraphs}\n"
        rows = []
        comment = []
        for i, line in enumerate(lines):
            stripped = line.strip()
            if stripped.startswith("///"):
                comment.append(stripped[3:].strip())
            elif comment:
                declaration = declaration_after(lines, i)
                if declaration and not declaration.startswith("//"):
                    rows.append((declaration, comment))
                comment = []
        for declaration, comment in rows:
            page += f"\n`{declaration}`\n\n{' '.join(comment)}\n"
    return page


# ---------------------------------------------------------------- the diagram of a step

PHASES = {
    "start_report": "empty the report",
    "choose_drops": "choose what this step leaves out, by its forecast",
    "find_live_effects": "effects that are switched on",
    "keep_start": "keep the surfaces as the step begins",
    "apply_inputs": "drive commands, pulls, the scene's script",
    "integrate_tissue": "integrate tissue in sub-steps, with solid contact inside them",
    "share_start": "pass the surfaces at the step's start to contact detection",
    "update_embedded_surfaces": "move surfaces that are embedded in tissue or moved by the scene",
    "predict_instruments": "predict the instruments' motion; their contact forces then act on the tissue",
    "update_sphere_trees": "spheres follow their surfaces",
    "traverse_sphere_trees": "coarse contact: pairs of spheres, interruptible",
    "detect_exact_contacts": "exact contact: continuous tests of skin against wall",
    "resolve_instruments": "instruments between planes of their walls; forces on the tissue",
    "push_solids": "places where solid surfaces touch, for the next step's sub-steps",
    "list_contacts": "the list of contacts",
    "finish_report": "independent checks, energies, whether the budget was kept",
}


def step_diagram():
    source = (ROOT / "engine/step/step.cpp").read_text()
    functions = re.findall(r"^(?:bool|const StepReport&) (begin_step|finish_step)\([^)]*\) \{\n(.*?)^\}", source, re.S | re.M)
    if [name for name, _ in functions] != ["begin_step", "finish_step"]:
        sys.exit("engine/step/step.cpp: expected begin_step and finish_step")
    diagram, table, before = "```mermaid\nflowchart TD\n", "| phase | does | time in | may end early |\n| --- | --- | --- | --- |\n", None
    for function, body in functions:
        diagram += f"    subgraph {function}\n"
        stage = ""
        for line in body.splitlines():
            if line.strip() in ("{", "}"):
                stage = ""
            timed = re.search(r"Timed timed\(report\.ms\.(\w+)", line)
            if timed:
                stage = timed.group(1)
            call = re.search(r"\b([a-z]+(?:_[a-z]+)+)\((.*)\);?", line)
            if not call or call.group(1) in ("static_cast",) or call.group(1) not in PHASES and line.strip().startswith(("const Phase", "const Collision", "const Account", "const Timed")):
                continue
            name = call.group(1)
            if name not in PHASES:
                sys.exit(f"engine/step/step.cpp calls {name}, which docs/make.py does not describe: add it to PHASES")
            diagram += f"        {name}[\"{name}<br>{PHASES[name]}\"]\n"
            if before:
                diagram += f"        {before} --> {name}\n"
            before = name
            own = {"traverse_sphere_trees": "descend", "detect_exact_contacts": "exact"}.get(name, stage)
            table += f"| `{name}` | {PHASES[name]} | {f'`{own}_ms`' if own else ''} | {'yes, by the budget' if 'budget' in call.group(2) and name not in ('finish_report', 'choose_drops', 'predict_instruments') else ''} |\n"
        diagram += "    end\n"
    return diagram + "```\n\n" + table


def with_diagram():
    page = (DOCS / "architecture.md").read_text()
    begin, end = "<!-- the step: written by docs/make.py -->\n", "<!-- end of the step -->\n"
    head, rest = page.split(begin)
    return head + begin + step_diagram() + rest[rest.index(end):]


# ----------------------------------------------------------------


def main():
    parser = argparse.ArgumentParser(description="Writes the generated pages of docs/ anew.")
    parser.add_argument("--check", action="store_true", help="write nothing; name what is stale, and end with 1 where anything is")
    parser.add_argument("--program", default=str(ROOT / "build/release/trocar"), help="the built program")
    options = parser.parse_args()

    def of_program(*words):
        command = words if words[0] == "schema" else ("docs", *words)
        ended = subprocess.run([options.program, *command], capture_output=True, text=True)
        if ended.returncode != 0:
            sys.exit(f"{options.program} {' '.join(command)}: {ended.stderr.strip()}")
        return ended.stdout

    def benchmarks():
        """The page as `trocar bench --docs` leaves it: nothing is measured."""
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(DOCS / "benchmarks.md", folder)
            shutil.copytree(DOCS / "measured", pathlib.Path(folder) / "measured")
            ended = subprocess.run([options.program, "bench", "--docs", folder], capture_output=True, text=True)
            if ended.returncode != 0:
                sys.exit(f"{options.program} bench --docs {folder}: {ended.stderr.strip()}")
            return (pathlib.Path(folder) / "benchmarks.md").read_text()

    pages = {"benchmarks.md": benchmarks, "commands.md": lambda: of_program("commands"), "outputs.md": lambda: of_program("outputs"), "scene.md": lambda: of_program("scene"),
             "sweep.md": lambda: of_program("sweep"), "../assets/scene.schema.json": lambda: of_program("schema"),
             "../assets/sweep.schema.json": lambda: of_program("schema", "--sweep"),
             "python_reference.md": python_reference, "cpp_reference.md": cpp_reference, "architecture.md": with_diagram}
    stale = []
    for name, make in pages.items():
        text, file = make(), DOCS / name
        if file.exists() and file.read_text() == text:
            continue
        stale.append(name)
        if not options.check:
            file.write_text(text)
    for name in stale:
        print(f"{'stale' if options.check else 'written'}: {(DOCS / name).resolve().relative_to(ROOT)}")
    if options.check and stale:
        sys.exit("python3 docs/make.py writes them anew")


if __name__ == "__main__":
    main()
