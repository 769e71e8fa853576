#!/usr/bin/env python3
"""Checks pages: every relative link leads to a file and an anchor, the index has every page, and no banned phrase is found.

    python3 tests/docs/check_pages.py [links|words]

Words are looked for in all Markdown, in comments of installed headers, and in what the program and its pages say. Keys of CSV and JSON
files keep their names.
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "docs"))
from make import public_headers  # noqa: E402

SKIPPED = {"build", "out", "node_modules", ".git", "trocar.egg-info"}


def files(pattern, *folders):
    for folder in folders or (".",):
        for file in sorted((ROOT / folder).rglob(pattern)):
            if not SKIPPED & set(file.relative_to(ROOT).parts):
                yield file


def without_code(text):
    return re.sub(r"^(```|~~~).*?^\1[^\n]*$", lambda m: "\n" * m.group(0).count("\n"), text, flags=re.S | re.M)


# ---------------------------------------------------------------- links


def slug(heading):
    """As GitHub makes an anchor of a heading."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    text = re.sub(r"[^\w\- ]", "", text.strip().lower())
    return text.replace(" ", "-")


def anchors(file):
    found, seen = set(), {}
    for heading in re.findall(r"^#{1,6} +(.+?) *#*$", without_code(file.read_text()), re.M):
        name = slug(heading)
        count = seen.get(name, 0)
        seen[name] = count + 1
        found.add(name if count == 0 else f"{name}-{count}")
    return found


def links_of(file):
    text = re.sub(r"`[^`\n]*`", "", without_code(file.read_text()))
    return re.findall(r"!?\[[^\]]*\]\(([^)\s]+)\)", text)


def broken_links():
    wrong, known = [], {}
    for file in files("*.md"):
        for link in links_of(file):
            if re.match(r"[a-z]+:", link):
                continue
            path, _, anchor = link.partition("#")
            target = (file.parent / path).resolve() if path else file
            where = f"{file.relative_to(ROOT)}: {link}"
            if not target.exists():
                wrong.append(f"{where}: no such file")
            elif anchor and target.suffix == ".md":
                if target not in known:
                    known[target] = anchors(target)
                if anchor not in known[target]:
                    wrong.append(f"{where}: no such heading")
    return wrong


def pages_without_a_place():
    docs = ROOT / "docs"
    listed = {(docs / link.partition("#")[0]).resolve() for link in links_of(docs / "README.md")}
    return [f"docs/README.md does not list {page.name}" for page in sorted(docs.glob("*.md")) if page.name != "README.md" and page.resolve() not in listed]


def too_long():
    lines = len((ROOT / "README.md").read_text().splitlines())
    return [f"README.md has {lines} lines, at most 150 are wanted"] if lines > 150 else []


# ---------------------------------------------------------------- words

BANNED = {
    r"would be right": "expected X",
    r"goes? on in slow motion|begins late": "late steps fall behind real time",
    r"when(ever)? somebody looks|somebody looks at it|who looked|looked at by": "evaluated lazily; names the reader",
    r"\bpok(e|es|ed|ing)\b": "penetrates",
    r"CPU twin": "CPU reference",
    r"culling by pictures|by pictures\b": "image-space culling",
    r"careful meeting": "CCD fallback",
    r"free balls?\b": "inscribed sphere",
    r"hold(s|ing)? back\b|held back\b": "scale to the safe fraction",
    r"insists? on exact|insist(s|ed)? on the exact": "force the exact stage",
    r"steer(s|ed|ing)? surfaces": "update embedded surface",
    r"\bthe hand\b|\bits hand\b|whose hand\b|of the hand\b": "user input, drive command",
    r"whip drag": "transverse drag",
    r"twist winds up": "torsional wind-up",
    r"seed 00\d": "the paper by its authors and year",
    r"first time of contact": "time of impact",
    r"memory of springs": "warm start",
    r"whole numbers\b": "integers",
    r"\blooked at\b|\blook at candidates\b": "tested",
    r"looks? ahead|looked ahead": "prediction; predicted position",
    r"whole search|how deep it lies|goes along with": "broad phase; penetration depth; coaxial inner device",
}


def strings_of(file):
    """What stands in quotes in a source: messages. Line by line; a key of a file, one word without a blank, is none."""
    for number, line in enumerate(file.read_text().splitlines(), 1):
        if line.lstrip().startswith(("#include", "//", "*")):
            continue
        for literal in re.findall(r'"((?:[^"\\]|\\.)*)"|`([^`]*)`', line):
            text = literal[0] or literal[1]
            if " " in text:
                yield number, text


def comments_of(file):
    for number, line in enumerate(file.read_text().splitlines(), 1):
        found = re.search(r"(?://+|/\*|^ \*)(.*)", line)
        if found:
            yield number, found.group(1)


def texts():
    """(file, line, text) of all that is read by people."""
    for file in files("*.md"):
        if file.name == "contributing.md":  # it lists them
            continue
        for number, line in enumerate(file.read_text().splitlines(), 1):
            yield file, number, line
    for file in [ROOT / header for header in public_headers()] + [ROOT / "engine/c_api/c_api.h"]:
        for number, text in comments_of(file):
            yield file, number, text
    for folder in ("engine/cli", "engine/report", "engine/experiments", "engine/scene", "engine/importing", "engine/viewer", "engine/prepare", "engine/io"):
        for file in files("*.cpp", folder):
            for number, text in strings_of(file):
                yield file, number, text
    for file in list(files("*.ts", "engine/viewer/page/src")):
        for number, text in strings_of(file):
            yield file, number, text
    for file in files("*.html", "engine/viewer/page/src"):
        for number, line in enumerate(file.read_text().splitlines(), 1):
            yield file, number, re.sub(r"<[^>]*>", " ", line)
    for file in list(files("*.py", "python/trocar")) + list(files("*.pyi", "python/trocar")):
        for number, line in enumerate(file.read_text().splitlines(), 1):
            yield file, number, line


def banned_words():
    wrong = []
    for file, number, text in texts():
        for phrase, instead in BANNED.items():
            for found in re.finditer(phrase, text, re.I):
                wrong.append(f"{file.relative_to(ROOT)}:{number}: \"{found.group(0)}\"; write: {instead}")
    return wrong


def main():
    what = sys.argv[1] if len(sys.argv) > 1 else "all"
    wrong = []
    if what in ("all", "links"):
        wrong += broken_links() + pages_without_a_place() + too_long()
    if what in ("all", "words"):
        wrong += banned_words()
    print("\n".join(wrong) if wrong else "nothing to mend")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
