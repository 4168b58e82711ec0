"""The stubs agree with the package."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import herglotz as hz
import pytest

STUBS = ast.parse(Path(hz.__file__).with_name("__init__.pyi").read_text())


def test_every_public_name_has_a_stub_and_a_docstring():
    named = {node.name for node in STUBS.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    assert set(hz.__all__) <= named
    # Named tuples that are only parts of others need not be public.
    assert named - set(hz.__all__) <= {"Place", "Work"}
    for name in hz.__all__:
        assert inspect.getdoc(getattr(hz, name)), name


def test_the_reference_has_every_public_name(tmp_path):
    pytest.importorskip("pdoc")
    command = [sys.executable, "-m", "pdoc", "--docformat", "numpy", "-o", str(tmp_path), "herglotz"]
    subprocess.run(command, check=True, capture_output=True)
    page = (tmp_path / "herglotz.html").read_text()
    for name in hz.__all__:
        assert f'id="{name}"' in page, name
    # The parameters of a function are a list, and formulas keep their stars.
    assert "The number of sites along each direction of the lattice" in page
    assert "<code>m*x'^2/2 - V(t, x) + gamma*z</code>" in page


def test_functions_have_the_arguments_of_their_stubs():
    for node in STUBS.body:
        if not isinstance(node, ast.FunctionDef):
            continue
        known = [argument.arg for argument in (*node.args.args, *node.args.kwonlyargs)]
        assert known == list(inspect.signature(getattr(hz, node.name)).parameters), node.name


def test_classes_have_what_their_stubs_have():
    sol = hz.solve("pendulum", t=1.0)
    made = {"Solution": sol, "Plan": sol.plan, "System": sol.system, "States": sol(0.5), "Event": hz.Event("theta")}
    made["SparseSolution"] = hz.bodies([1.0, 1.0], [[0.0, 0.0], [1.0, 0.0]], 0.0, 0.1, step=0.1)
    made["RigidBodySolution"] = hz.rigid_body((1, 2, 3), omega=(1, 1, 1), t=1.0)
    made["RigidBodyStates"] = made["RigidBodySolution"].end
    made["Ensemble"] = hz.ensemble("pendulum", [[1.0]], [[0.0]], 1.0)
    made["Geometry"] = hz.geometry("pendulum", 0.0, [1.0], [0.0])
    made["Contact"] = hz.is_contact(lambda q, p, z: (q, p, z), ([1.0], [0.0], 0.0))
    times = [0.0, 1.0, 2.0]
    made["Fit"] = hz.fit("pendulum", t=times, data={"theta": [1.0, 0.6, -0.3]}, unknowns=["gamma"])
    for node in STUBS.body:
        if isinstance(node, ast.ClassDef) and node.name in made:
            for member in node.body:
                name = member.target.id if isinstance(member, ast.AnnAssign) else getattr(member, "name", None)
                if name is not None:
                    assert hasattr(made[node.name], name), (node.name, name)
