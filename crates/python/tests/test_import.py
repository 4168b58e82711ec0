"""Modules that are loaded with the package, and those that are loaded at first use."""

import subprocess
import sys

import herglotz as hz
import pytest


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
