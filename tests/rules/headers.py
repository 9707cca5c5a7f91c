#!/usr/bin/env python3
"""Every header includes the headers of the names that it uses.   headers.py SOURCE_DIR [COMPILER FLAGS...]

At least one file of the program, other than the source file of the same name, must include the header: code that only tests
use belongs in tests/. Each name of the standard library and of Eigen that a header uses, and each type of this project, must
come from a header that it includes, directly or through headers of this project; a type may be declared instead. These checks
read only the text and take a second. With a compiler, each header is also compiled by itself. This takes minutes and finds all
other missing includes.
"""
import concurrent.futures
import os
import re
import subprocess
import sys

# Names of the standard library, by the header that declares them. Another header may declare them, too.
GIVEN_BY = {
    "algorithm": "min max minmax clamp copy find_if swap_ranges ranges sort",
    "any": "any",
    "array": "array",
    "atomic": "atomic atomic_ref memory_order_relaxed memory_order_release memory_order_acquire",
    "bit": "bit_cast countr_zero countl_zero popcount bit_ceil bit_width",
    "chrono": "chrono",
    "cmath": "sqrt abs floor ceil ilogb ldexp sin cos tan atan2 acos asin exp log pow hypot isfinite round cbrt",
    "compare": "strong_ordering weak_ordering partial_ordering",
    "concepts": "same_as invocable floating_point integral convertible_to derived_from",
    "condition_variable": "condition_variable",
    "cstddef": "size_t ptrdiff_t nullptr_t byte",
    "cstdio": "FILE",
    "cstring": "memcpy memcmp memset strlen",
    "deque": "deque",
    "exception": "exception exception_ptr current_exception rethrow_exception uncaught_exceptions",
    "filesystem": "filesystem",
    "functional": "function greater less hash reference_wrapper ref cref",
    "future": "future promise async",
    "initializer_list": "initializer_list",
    "iosfwd": "istream ostream",
    "limits": "numeric_limits",
    "list": "list",
    "map": "map multimap",
    "memory": "unique_ptr shared_ptr weak_ptr make_unique make_shared",
    "mutex": "mutex lock_guard unique_lock scoped_lock once_flag call_once",
    "numbers": "numbers",
    "numeric": "iota accumulate lerp midpoint",
    "optional": "optional nullopt",
    "queue": "priority_queue queue",
    "set": "set multiset",
    "span": "span dynamic_extent as_bytes",
    "stdexcept": "invalid_argument runtime_error logic_error out_of_range length_error",
    "string": "string to_string stod stoi",
    "string_view": "string_view",
    "thread": "thread this_thread jthread",
    "tuple": "tuple tie make_tuple apply",
    "type_traits": "is_same_v is_arithmetic_v is_enum_v is_constructible_v is_base_of_v conditional_t "
                   "is_trivially_copyable_v is_integral_v "
                   "remove_reference_t remove_cvref_t enable_if_t decay_t false_type true_type underlying_type_t invoke_result_t",
    "unordered_map": "unordered_map",
    "unordered_set": "unordered_set",
    "utility": "move forward swap exchange as_const pair make_pair in_place declval index_sequence",
    "variant": "variant holds_alternative get get_if visit monostate variant_alternative_t",
    "vector": "vector erase",
}
NEEDED = {name: header for header, names in GIVEN_BY.items() for name in names.split()}
# Headers of the standard library that also declare the names of other headers, by the C++ standard.
ALSO_GIVES = {
    "algorithm": ["initializer_list"], "array": ["compare", "initializer_list", "cstddef"], "deque": ["compare", "initializer_list"],
    "filesystem": ["compare"], "map": ["compare", "initializer_list"], "mutex": ["chrono"], "condition_variable": ["chrono", "mutex"],
    "optional": ["compare"], "queue": ["compare", "deque", "vector"], "set": ["compare", "initializer_list"],
    "span": ["cstddef", "dynamic_extent"], "string": ["compare", "initializer_list", "string_view"], "thread": ["compare"],
    "tuple": ["compare"], "utility": ["compare", "initializer_list"], "variant": ["compare"],
    "vector": ["compare", "initializer_list"],
}
# Every header of a container, string or view declares std::size_t. move, forward and swap are in headers that
# every program includes.
EVERYWHERE = {"size_t", "ptrdiff_t", "nullptr_t", "move", "forward", "swap"}
FOLDERS = ("sim", "effects", "render", "demos/producer", "demos/engine", "demos/tune")


# Finds the types that a header defines in a namespace, and all types that it defines or declares: also nested types and
# parameters of templates.
DEFINITION = r"^(?:(?:class|struct|enum(?: class)?) (\w+)(?:[^;{]*)\{)|^using (\w+) =|^concept (\w+)"
DECLARATION = r"\b(?:enum class|class|struct|enum|using|typename|concept) (\w+)"


def headers_of(source):
    for folder in FOLDERS:
        for at, _, names in os.walk(os.path.join(source, folder)):
            yield from (os.path.relpath(os.path.join(at, name), source) for name in names if name.endswith(".h"))


def without_comments(text):
    return re.sub(r'//[^\n]*|/\*.*?\*/|"(\\.|[^"\\\n])*"', lambda m: m.group() if m.group()[0] == '"' else " ", text, flags=re.S)


class Header:
    def __init__(self, source, path):
        with open(os.path.join(source, path), encoding="utf-8") as file:
            text = without_comments(file.read())
        self.foreign = set(re.findall(r"^#include <([^>]+)>", text, re.M))
        self.own = set(re.findall(r'^#include "([^"]+)"', text, re.M))
        code = re.sub(r"^#.*$", "", text, flags=re.M)
        self.names = set(re.findall(r"\bstd::(\w+)", code)) - EVERYWHERE
        self.uses_eigen = "Eigen::" in code
        self.types = {name for names in re.findall(DEFINITION, code, re.M) for name in names if name}
        self.words = set(re.findall(r"(?<![\w:.>])[A-Z]\w*[a-z]\w*", code)) - set(re.findall(DECLARATION, code)) - self.types


def included_by(path, headers):
    """Returns `path` and the headers of the project that it includes, directly or through others."""
    found, open_paths = set(), [path]
    while open_paths:
        path = open_paths.pop()
        if path not in found:
            found.add(path)
            open_paths += [p for name in headers[path].own for p in (name, "demos/" + name) if p in headers]
    return found


def missing_includes(path, headers, homes):
    """Yields a message for each name that `path` uses without its header; `homes`: the headers of each type."""
    own = included_by(path, headers)
    foreign = set().union(*(headers[p].foreign for p in own))
    given = foreign | {other for name in foreign for other in ALSO_GIVES.get(name, [])}
    for name in sorted(headers[path].names):
        if name not in NEEDED:
            yield f"std::{name} is not in the table of {os.path.basename(__file__)}"
        elif NEEDED[name] not in given:
            yield f"std::{name} needs <{NEEDED[name]}>"
    if headers[path].uses_eigen and not any(name.startswith("Eigen/") for name in foreign):
        yield "Eigen:: needs a header of Eigen"
    for word in sorted(headers[path].words & homes.keys()):
        if not homes[word] & own:
            yield f"{word} needs {' or '.join(sorted(homes[word]))}"


def unused_headers(headers):
    """Returns the headers that only the source file of the same name includes, or no file."""
    used = set()
    for folder in ("sim", "effects", "render", "demos"):
        for at, _, names in os.walk(folder):
            for name in names:
                path = os.path.join(at, name)
                if path.endswith((".h", ".cpp")):
                    with open(path, encoding="utf-8") as file:
                        found = re.findall(r'^#include "([^"]+)"', file.read(), re.M)
                    used |= {p for f in found for p in (f, "demos/" + f) if p[:-2] != path[:-4]}
    return [path for path in headers if path not in used]


def compiled_alone(paths, command):
    """Yields the compiler's errors for each header that does not compile alone."""
    def compile_one(path):
        return subprocess.run([*command, "-fsyntax-only", "-x", "c++", "-"], text=True, capture_output=True,
                              input=f'#include "{path}"\n', check=False)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for path, result in zip(paths, pool.map(compile_one, paths)):
            if result.returncode != 0:
                yield f"{path} does not compile alone:\n{result.stderr}"


def main():
    os.chdir(sys.argv[1])
    headers = {path: Header(".", path) for path in sorted(headers_of("."))}
    homes = {}
    for path, header in headers.items():
        for name in header.types:
            homes.setdefault(name, set()).add(path)
    problems = [f"{path}: {problem}" for path in headers for problem in missing_includes(path, headers, homes)]
    problems += [f"{path}: no source of the program includes it" for path in unused_headers(headers)]
    if len(sys.argv) > 2:
        problems += compiled_alone(list(headers), sys.argv[2:])
    print("\n".join(problems))
    return 1 if problems else 0


sys.exit(main())


