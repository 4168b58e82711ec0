"""Modules that are loaded with the package, and those that are loaded at first use."""

import subprocess
import sys

import herglotz as hz
import pytest
from herglotz import _processor


def test_what_a_motion_does_not_need_is_loaded_later():
    code = (
        "import sys, herglotz as hz\n"
        "assert not {'herglotz._checks', 'herglotz._ensemble', 'herglotz._exact'} & {*sys.modules}\n"
        "assert {*hz.__all__} <= {*dir(hz)}\n"
        "assert all(getattr(hz, name) is getattr(hz, name) for name in hz.__all__)\n"
        "assert 'herglotz._checks' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_unknown_name_is_none_of_the_package():
    with pytest.raises(AttributeError, match="module 'herglotz' has no attribute 'ensembel'"):
        hz.ensembel


def test_a_wheel_for_other_machines_needs_vector_instructions(monkeypatch):
    """A package that was built on this machine needs none; names that numpy does not know are not missed."""

    class Built:
        def __init__(self, tag):
            self.tag = tag

        def read_text(self, name):
            return f"Root-Is-Purelib: false\nTag: cp310-abi3-{self.tag}\n" if name == "WHEEL" else None

    for tag, is_refused in [("linux_x86_64", False), ("manylinux_2_35_x86_64", True)]:
        monkeypatch.setattr("importlib.metadata.distribution", lambda name, tag=tag: Built(tag))
        _processor.check({})
        _processor.check({"AVX2": True, "FMA3": True})
        lacks = {"AVX2": True, "FMA3": False}
        if is_refused:
            with pytest.raises(ImportError, match="has no FMA3; build the package here"):
                _processor.check(lacks)
        else:
            _processor.check(lacks)
