#!/usr/bin/env python3
"""No function is longer than a page or two.   lengths.py SOURCE_DIR

Prints each function of more than 80 lines, which is an error, and with --files each file of more than 600 lines.
A function is the text from a line that ends in `{` to the line `}` of the same indentation, as clang-format lays it out.
"""
import os
import re
import sys

LONGEST_FUNCTION, LONG_FILE = 80, 600
FOLDERS = ("sim", "effects", "render", "demos")
NO_FUNCTION = re.compile(r"\s*(namespace|struct|class|enum|union|extern|if|for|while|switch|else|do)\b")


def functions(lines):
    """Start and length of each function outside of functions."""
    at = 0
    while at < len(lines):
        opens = re.match(r"( {0,2})\S.*\{$", lines[at])
        head = " ".join(lines[max(0, at - 3):at + 1])
        if opens and "(" in head and not NO_FUNCTION.match(lines[at]) and not lines[at].startswith("}"):
            indent = opens.group(1)
            end = next((i for i in range(at + 1, len(lines)) if re.match(indent + r"\}", lines[i])), at)
            yield at + 1, end - at + 1
            at = max(end, at)
        at += 1


def main():
    os.chdir(sys.argv[1])
    problems, long_files = [], []
    for folder in FOLDERS:
        for place, _, names in os.walk(folder):
            for path in sorted(os.path.join(place, name) for name in names if name.endswith((".h", ".cpp"))):
                with open(path, encoding="utf-8") as file:
                    lines = file.read().splitlines()
                problems += [f"{path}:{line}: a function of {length} lines; at most {LONGEST_FUNCTION} are allowed"
                             for line, length in functions(lines) if length > LONGEST_FUNCTION]
                if len(lines) > LONG_FILE:
                    long_files.append(f"{path}: {len(lines)} lines")
    for line in problems + (long_files if "--files" in sys.argv else []):
        print(line)
    return 1 if problems else 0


sys.exit(main())
