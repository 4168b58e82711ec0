"""Tables and named times of jumps: values, closed forms, names in texts, and errors."""

import pickle

import herglotz as hz
import numpy as np
import pytest

TIMES, VALUES = np.array([0.0, 1.0, 2.5, 4.0]), np.array([0.0, 2.0, -1.0, 0.5])


def test_values():
    at = np.linspace(-1, 5, 61)
    linear = hz.table(TIMES, VALUES)
    assert np.allclose(linear(at), np.interp(at, TIMES, VALUES), rtol=0, atol=1e-15)
    assert linear(0.5) == 1.0 and isinstance(linear(0.5), float) and linear(np.float64(0.5)) == 1.0 and linear(1) == 2.0
    assert linear([[0.0, 0.5], [1.0, 9.0]]).tolist() == [[0.0, 1.0], [2.0, 0.5]]
    assert np.isnan(linear(np.nan))
    held = hz.table(TIMES, VALUES, "held")
    assert held([-1.0, 0.5, 1.0, 3.0, 9.0]).tolist() == [0.0, 0.0, 2.0, -1.0, 0.5]
    cubic = hz.table(TIMES, TIMES**3 - TIMES, pieces="cubic")
    assert np.allclose(cubic(np.linspace(0, 4, 9)), np.linspace(0, 4, 9) ** 3 - np.linspace(0, 4, 9), atol=1e-12)
    assert (linear.pieces, held.pieces, cubic.pieces) == ("linear", "held", "cubic")
    assert linear.t.tolist() == TIMES.tolist() and linear.y.tolist() == VALUES.tolist()
    assert repr(linear) == "<Table: 4 samples from t = 0 to 4, linear>"


def test_equal_samples_make_equal_tables():
    linear, held = hz.table(TIMES, VALUES), hz.table(list(TIMES), tuple(VALUES), "held")
    assert linear == hz.table(TIMES, VALUES) == pickle.loads(pickle.dumps(linear)) and linear != held
    assert linear.name == hz.table(TIMES, VALUES).name != held.name and len({linear, held}) == 2


# The motion x'' = drive(t) from rest over the first piece, and over all of them.
def pushed(t, times, values):
    """The position at t by the integrals of the pieces."""
    q = v = 0.0
    for a, b, left, right in zip(times, times[1:], values, values[1:]):
        h, slope = min(b, t) - a, (right - left) / (b - a)
        if h <= 0:
            break
        q += v * h + left * h**2 / 2 + slope * h**3 / 6
        v += left * h + slope * h**2 / 2
    return q


DRIVE = hz.table(TIMES, VALUES)
WAYS = {
    "in L": dict(L=lambda t, q, v, z: v @ v / 2 + q[0] * DRIVE(t)),
    "in a force": dict(L=lambda t, q, v, z: v @ v / 2, force=lambda t, q, v, z: DRIVE(t)),
    "in both": dict(L=lambda t, q, v, z: v @ v / 2 + q[0] * DRIVE(t) / 2, force=lambda t, q, v, z: DRIVE(t) / 2),
    "of an array": dict(L=lambda t, q, v, z: v @ v / 2 + q @ DRIVE(hz.array([t]))),
    "in a text": dict(L="x'^2/2 + x*drive(t)", coordinates=["x"], tables={"drive": DRIVE}),
    "in the text of a force": dict(L="x'^2/2", force="drive(t)", coordinates=["x"], tables={"drive": DRIVE}),
}


@pytest.mark.parametrize("way", WAYS)
def test_motions_with_a_drive(way):
    t = np.array([0.0, 0.7, 1.0, 1.9, 3.3, 4.0])
    sol = hz.solve(**WAYS[way], q0=[0.0], v0=[0.0], t=t, accuracy=1e-12)
    wanted = [pushed(x, TIMES, VALUES) for x in t]
    assert np.allclose(sol.q[:, 0], wanted, rtol=0, atol=1e-12)
    # Dense evaluation, also at the samples, and continued motions.
    assert np.allclose(sol([3.3, 1.0]).q[:, 0], [wanted[4], wanted[2]], rtol=0, atol=1e-12)
    assert abs(hz.solve(**WAYS[way], q0=[0.0], v0=[0.0], t=2.0, accuracy=1e-12).resume(4.0).q[-1, 0] - wanted[-1]) < 1e-12


def test_a_drive_with_jumps():
    drive = hz.table([0.0, 1.0, 2.0], [1.0, -1.0, 0.0], "held")
    sol = hz.solve(lambda t, q, v, z: v @ v / 2 + q[0] * drive(t), [0.0], [0.0], 3.0, accuracy=1e-12)
    assert abs(sol.q[-1, 0] - 1.0) < 1e-12 and abs(sol.v[-1, 0]) < 1e-12


def test_tables_in_columns_events_and_pickled_solutions():
    sol = hz.solve(
        lambda t, q, v, z: v @ v / 2,
        [0.0],
        [1.0],
        TIMES,
        observe={"drive": lambda t, q, v, z: DRIVE(t)},
        events=lambda t, q, v, z: q[0] - DRIVE(t),
    )
    assert np.allclose(sol["drive"], VALUES, atol=1e-12)
    # q = t meets 2 - 2 (t - 1) at 4/3.
    assert sol.events[0].t == pytest.approx([4 / 3], abs=1e-12)
    again = pickle.loads(pickle.dumps(sol))
    assert again(4 / 3).q[0] == pytest.approx(4 / 3, abs=1e-12) and again.system.tables == sol.system.tables


def test_parameters_shift_a_table():
    def L(t, q, v, z, t0, amplitude):
        return v @ v / 2 + amplitude * q[0] * DRIVE(t - t0)

    t0 = np.array([0.0, 0.5, 1.0])
    many = hz.ensemble(L, np.zeros((3, 1)), np.zeros((3, 1)), 4.0, accuracy=1e-12, parameters={"t0": t0, "amplitude": 2.0})
    assert np.allclose(many.q[:, 0], [2 * pushed(4 - x, TIMES, VALUES) for x in t0], rtol=0, atol=1e-11)


def test_a_map_with_a_table():
    held = hz.table([-5.0, 0.0], [2.0, 2.0])
    assert hz.is_contact(lambda q, p, z: (q, held(q[0]) * p, 2 * z), ([1.0], [1.0], 0.0))


def test_named_times_of_jumps():
    def L(t, q, v, z):
        return v @ v / 2 + q[0] * np.tanh(1e9 * (t - 3.0))

    sol = hz.solve(L, [0.0], [0.0], 5.0, accuracy=1e-10, breaks=[3.0])
    assert abs(sol.q[-1, 0] - (-4.5 - 6.0 + 2.0)) < 1e-7
    assert sol.system.breaks == [3.0] and pickle.loads(pickle.dumps(sol.system)).breaks == [3.0]
    many = hz.ensemble(L, [[0.0]], [[0.0]], 5.0, accuracy=1e-10, breaks=[3.0])
    assert many.q[0, 0] == pytest.approx(sol.q[-1, 0], abs=1e-9)


FREE = dict(L="x'^2/2", q0=[0.0], v0=[1.0], t=[1.0, 5.0], coordinates=["x"])
WRONG = {
    "one sample": (lambda: hz.table([0.0], [1.0]), "it needs at least 2"),
    "no samples": (lambda: hz.table([], []), "it needs at least 2"),
    "equal times": (lambda: hz.table([0.0, 1.0, 1.0], [1.0, 2.0, 3.0]), "must increase, but sample 2 at 1 follows one at 1"),
    "times that decrease": (lambda: hz.table([1.0, 0.0], [1.0, 2.0]), "must increase"),
    "a time that is NaN": (lambda: hz.table([0.0, np.nan], [1.0, 2.0]), r"`t\[1\]` is NaN; it must be a finite number"),
    "a value that is NaN": (lambda: hz.table([0.0, 1.0], [1.0, np.nan]), r"`y\[1\]` is NaN; it must be a finite number"),
    "lengths": (lambda: hz.table([0.0, 1.0], [1.0, 2.0, 3.0]), "2 times and 3 values; each time needs one value"),
    "a matrix": (lambda: hz.table([[0.0, 1.0]], [1.0, 2.0]), r"`t` has the shape \[1, 2\]; it must have one dimension"),
    "texts": (lambda: hz.table(["a", "b"], [1.0, 2.0]), "`t` has the dtype"),
    "unknown pieces": (lambda: hz.table([0.0, 1.0], [1.0, 2.0], "spline"), '`pieces` is "spline"; it must be "linear"'),
    "a text as an argument": (lambda: DRIVE("now"), "a table is evaluated at"),
    "a list of tables": (lambda: hz.solve(**FREE, tables=[DRIVE]), "`tables` is .*tables="),
    "an array as a table": (lambda: hz.solve(**FREE, tables={"drive": VALUES}), r"tables\['drive'\] is .*hz.table"),
    "the name of a coordinate": (lambda: hz.solve(**FREE, tables={"x": DRIVE}), "x.*is given twice"),
    "the name of a function": (lambda: hz.solve(**FREE, tables={"sin": DRIVE}), "sin.*is reserved"),
    "a table as a force": (lambda: hz.solve(**FREE, force=DRIVE), "`force` is <Table.*function"),
    "a break before the start": (lambda: hz.solve(**FREE, breaks=[0.5]), "`breaks` contains 0.5, but the motion runs from 1.0 to 5.0"),
    "a break after the end": (lambda: hz.solve(**FREE, breaks=[3.0, 5.5]), "`breaks` contains 5.5"),
    "breaks that decrease": (lambda: hz.solve(**FREE, breaks=[3.0, 2.0]), "`breaks` must increase, but 2.0 follows 3.0"),
    "equal breaks": (lambda: hz.system("x'^2", ["x"], breaks=[3.0, 3.0]), "`breaks` must increase"),
    "a break that is NaN": (lambda: hz.solve(**FREE, breaks=[np.nan]), r"`breaks\[0\]` is nan; it must be a finite number"),
    "a single break": (lambda: hz.solve(**FREE, breaks=3.0), r"`breaks` is 3.0; it must be a list of times, as in breaks=\[3.0\]"),
    "a break of a check": (lambda: hz.check(**FREE, breaks=[6.0]), "`breaks` contains 6.0"),
    "a break of an ensemble": (
        lambda: hz.ensemble("x'^2/2", [[0.0]], [[1.0]], 5.0, coordinates=["x"], breaks=[-1.0]),
        "`breaks` contains -1.0, but the motion runs from 0.0 to 5.0",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_tables_and_breaks(case):
    call, message = WRONG[case]
    with pytest.raises(ValueError, match=message):
        call()
