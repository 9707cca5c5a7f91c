"""Builds a wheel of the module for pip (PEP 517) by CMake alone: no Python package is needed.

The build folder is build-python, or the one that OFFSTAGE_BUILD names, which must be configured with OFFSTAGE_PYTHON=ON.
"""

import base64
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]


def _version():
    return re.search(r"project\(offstage VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)


def _tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def _install(prefix):
    build = os.environ.get("OFFSTAGE_BUILD")
    if not build:
        build = SOURCE / "build-python"
        subprocess.run(["cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DOFFSTAGE_PYTHON=ON",
                        "-DOFFSTAGE_TESTS=OFF", "-DOFFSTAGE_BENCH=OFF", f"-DPython3_EXECUTABLE={sys.executable}"], check=True)
    subprocess.run(["cmake", "--build", build, "--target", "offstage_python"], check=True)
    subprocess.run(["cmake", "--install", build, "--component", "python", "--prefix", prefix], check=True)
    return next(pathlib.Path(prefix).rglob("offstage/__init__.py")).parent


def _metadata():
    return f"Metadata-Version: 2.1\nName: offstage\nVersion: {_version()}\nRequires-Dist: numpy\n"


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    name = f"offstage-{_version()}-{_tag()}.whl"
    info = f"offstage-{_version()}.dist-info"
    with tempfile.TemporaryDirectory() as prefix:
        package = _install(prefix)
        files = {f"offstage/{path.relative_to(package)}": path.read_bytes() for path in sorted(package.rglob("*")) if path.is_file()}
    files[info + "/METADATA"] = _metadata().encode()
    files[info + "/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: offstage\nRoot-Is-Purelib: false\nTag: {_tag()}\n".encode()
    record = info + "/RECORD"
    rows = []
    for path, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        rows.append(f"{path},sha256={digest},{len(data)}\n")
    files[record] = ("".join(rows) + f"{record},,\n").encode()
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data in files.items():
            wheel.writestr(path, data)
    return name

