"""The Python code of the documentation runs, and prints what the documentation shows.

A value that is shown stands in a comment behind its statement, `expression  # -> value`, with words after a colon or a
semicolon. Its numbers agree with those of the run in all digits that are shown, and all else is the same. Other comments
behind expressions have no numbers, so that none is shown that is not compared.
"""

import ast
import contextlib
import importlib.util
import io
import re
import tokenize
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).parents[3]
FILES = ["README.md", *(f"docs/{name}" for name in ("python.md", "guide.md"))]
NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def blocks(text):
    """The blocks of Python code, each with the number of its first line."""
    for found in re.finditer(r"^```python\n(.*?)^```", text, re.S | re.M):
        yield text[: found.start()].count("\n") + 2, found[1]


def comments(code):
    """The comments of a block by their lines."""
    tokens = tokenize.generate_tokens(io.StringIO(code).readline)
    return {token.start[0]: token.string.lstrip("#").strip() for token in tokens if token.type == tokenize.COMMENT}


def agrees(shown_text, found):
    """Whether a text agrees with a value that was found, in all digits that it has."""
    # Without the names of NumPy's types.
    plain = lambda text: re.sub(r"(array|np\.\w+)\(|[()\s]", "", text)
    apart = lambda text: (NUMBER.sub("#", plain(text)).replace("#.", "#"), [x[0] for x in NUMBER.finditer(plain(text))])
    (words, numbers), (of_words, of_numbers) = apart(shown_text), apart(found)
    return words == of_words and len(numbers) == len(of_numbers) and all(map(rounds_to, numbers, of_numbers))


def rounds_to(text, found):
    """Whether a number is one that was found, rounded to its digits."""
    digits, _, exponent = text.lower().partition("e")
    decimals = len(digits.partition(".")[2])
    unit = 10.0 ** (int(exponent or 0) - decimals)
    # Half a unit, and as much again for a last digit that differs between processors.
    return abs(float(text) - float(found)) <= (unit if "." in text or exponent else 0.0)


def run(code, first, names):
    """Runs a block, and returns what is shown wrongly, with the lines."""
    wrong, said = [], comments(code)
    for statement in ast.parse(code).body:
        comment = said.get(statement.end_lineno, "")
        at, is_value = first + statement.end_lineno - 1, comment.startswith("->")
        part = ast.Module([statement], [])
        if not isinstance(statement, ast.Expr):
            if is_value:
                wrong.append(f"line {at}: {comment!r} stands behind no expression")
            exec(compile(part, "block", "exec"), names)
            continue
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            value = eval(compile(ast.Expression(statement.value), "block", "eval"), names)
        with np.printoptions(precision=17):
            found = printed.getvalue() or repr(value)
        claim = re.split(r"[:;](?= )", comment[2:].strip(), maxsplit=1)[0]
        if is_value and not agrees(claim, found):
            wrong.append(f"line {at}: shows {claim}, but is {found}")
        if not is_value and NUMBER.search(comment):
            wrong.append(f"line {at}: {comment!r} has a number; show the value as `# -> {found.strip()}`")
    return wrong


@pytest.mark.parametrize("file", FILES)
def test_code_prints_what_is_shown(file):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    pytest.importorskip("scipy")
    names, wrong, ran = {}, [], 0
    for first, code in blocks((REPOSITORY / file).read_text()):
        missing = [package for package in ("jax", "torch") if re.search(rf"import .*\b{package}\b", code)]
        if any(importlib.util.find_spec(package) is None for package in missing):
            continue
        wrong += run(code, first, names)
        ran += 1
    assert ran and not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "code, said",
    [
        ("1 / 3  # -> 0.333", None),
        ("1 / 3  # -> 0.334", None),
        ("1 / 3  # -> 0.335", "shows 0.335, but is 0.333"),
        ("1, 'a'  # -> 1, 'a': two values", None),
        ("1, 'a'  # -> 1, 'b'", "shows 1, 'b'"),
        ("1, 2  # -> 1, 3", "shows 1, 3"),
        ("[1]  # -> [1, 2]", "shows"),
        ("print('done', 0.25)  # -> done 0.25", None),
        ("print('done', 0.25)  # -> failed 0.25", "shows failed"),
        ("1 + 1  # two", None),
        ("1 + 1  # [2]", "has a number"),
        ("x = 1  # -> 1", "behind no expression"),
        ("import numpy as np\nnp.array([1.0, 2.0]), np.float64(0.5)  # -> [1.0, 2.0], 0.5", None),
        ("import numpy as np\nnp.array([1 / 3])  # -> [0.333333333333]", None),
    ],
)
def test_what_is_shown_wrongly_is_found(code, said):
    wrong = run(code, 1, {})
    assert len(wrong) == (said is not None) and all(said in text for text in wrong), wrong
