//! The coefficients of the map of a linear step.

use crate::gauss::stages::product::{dot, matrix_product, product};
use crate::gauss::system::{CollocationSystem, PointDerivatives, PointGradient, PointRef};
use crate::gauss::tables::condensed::Condensed;
use crate::numbers::compensated::Unevaluated;
use crate::numbers::double_double::solve_exactly;
use contact_geom::nalgebra::{DMatrix, DVector};
use contact_geom::support::linear;
use num_traits::{One, Zero};
use qd::Quad;

/// The affine map of a step from (q0, v0) to the changes `q1 - q0` and `v1 - v0`, and the change of the action.
pub(crate) struct StepMap {
    /// The coefficients of `q_j` and `v_j` in the change of `q_i`, and those in the change of `v_i`, in row i and column
    /// j; row by row.
    pub rows: Vec<[Unevaluated; 4]>,
    /// The constant changes of `q_i` and `v_i`.
    pub shifts: Vec<[Unevaluated; 2]>,
    pub grow: Unevaluated,
    pub action: Option<Action>,
}

/// The change of the action in a step without the term `grow z`: a polynomial of degree two in the velocity and in the
/// position relative to a reference point. The reference point is the equilibrium if there is one; with another one the
/// terms would cancel as a motion comes to rest, and leave their round-off.
pub(crate) struct Action {
    pub equilibrium_position: Vec<f64>,
    /// The coefficients of `q_i q_j`, `q_i v_j` and `v_i v_j`, row by row.
    pub quadratic: Vec<[f64; 3]>,
    /// The coefficients of `q_i` and `v_i`.
    pub linear: Vec<[f64; 2]>,
    pub constant: f64,
}

/// The map of a step, and the accelerations of its stages as affine functions of (q0, v0), in row `i n + d`.
pub(crate) struct LinearStages {
    pub map: StepMap,
    pub accelerations: Vec<Vec<f64>>,
}

/// A number, or 0.
fn unit(is_there: bool, x: Quad) -> Quad {
    if is_there { x } else { Quad::zero() }
}

/// The zero of a force that is affine in the positions, from its derivative and its value at the origin; the origin if
/// there is no zero, or more than one.
fn equilibrium(slope: &DMatrix<f64>, at_origin: &[f64]) -> Vec<f64> {
    let mut position = -DVector::from_column_slice(at_origin);
    if position.iter().all(|x| *x == 0.0) {
        return vec![0.0; at_origin.len()];
    }
    let solved = linear::solve(&mut slope.clone(), &mut position).is_ok() && position.iter().all(|x| x.is_finite());
    if solved { position.as_slice().to_vec() } else { vec![0.0; at_origin.len()] }
}

impl LinearStages {
    /// The step for `a = M^-1 L_q = -K q + f`; `None` if the stage equations are singular.
    pub fn new(
        system: &dyn CollocationSystem,
        table: &Condensed,
        inverse_mass: &DMatrix<f64>,
        t: f64,
        start: PointRef<'_>,
        wants_z: bool,
    ) -> Option<Self> {
        let (s, n, one) = (table.s, start.q.len(), Quad::one());
        let origin = vec![0.0; n];
        let mut at_start = PointDerivatives::of(system);
        system.derivatives(t, start, &mut at_start);
        let gradient = |q: &[f64]| {
            let mut gradient = PointGradient::zeros(n);
            system.gradient(t, PointRef { q, v: &origin, z: 0.0 }, &mut gradient);
            gradient
        };
        let acceleration = |force: &[f64]| {
            let mut acceleration = vec![0.0; n];
            product(inverse_mass, force, &mut acceleration);
            acceleration
        };
        let at_origin = gradient(&origin);
        let (mut slope, constant) = (DMatrix::zeros(n, n), acceleration(&at_origin.q));
        matrix_product(inverse_mass, &at_start.qq, &mut slope);
        let place = equilibrium(&at_start.qq, &at_origin.q);
        let at_place = gradient(&place);
        let constant_at_place = acceleration(&at_place.q);
        // The equations of the stage accelerations, in rows (i, d): a_id - sum slope B a = slope (q0 + u v0) + f. The
        // right-hand sides are those of the unit vectors of q0 and v0, then f at the origin and f at the reference
        // point.
        let [last, sides] = [2 * n, 2 * n + 2];
        let mut rows: Vec<Vec<Quad>> = (0..s * n)
            .map(|row| {
                let (i, d) = (row / n, row % n);
                let left = (0..s * n).map(|column| {
                    let (k, e) = (column / n, column % n);
                    unit(row == column, one) - Quad::from(slope[(d, e)]) * table.b[i][k]
                });
                let right = (0..sides).map(|side| match side {
                    side if side < n => Quad::from(slope[(d, side)]),
                    side if side < 2 * n => Quad::from(slope[(d, side - n)]) * table.u[i],
                    side if side == last => Quad::from(constant[d]),
                    _ => Quad::from(constant_at_place[d]),
                });
                left.chain(right).collect()
            })
            .collect();
        if !solve_exactly(&mut rows) {
            return None;
        }
        let solution = Solution { table, n, rows };
        let exact = &table.exact;
        let sum = |w: &[Quad], d: usize, side: usize| solution.sum(w, d, side);
        let action = wants_z.then(|| {
            let rest = system.value(t, PointRef { q: &place, v: &origin, z: 0.0 });
            solution.action(&at_start, &at_place, rest, place)
        });
        let entries = |d: usize, e: usize| -> [Unevaluated; 4] {
            [
                sum(&exact.end_b, d, e).into(),
                (unit(d == e, exact.end_u) + sum(&exact.end_b, d, n + e)).into(),
                sum(&exact.end_v, d, e).into(),
                (unit(d == e, exact.grow) + sum(&exact.end_v, d, n + e)).into(),
            ]
        };
        let map = StepMap {
            rows: (0..n * n).map(|index| entries(index / n, index % n)).collect(),
            shifts: (0..n).map(|d| [&exact.end_b, &exact.end_v].map(|w| sum(w, d, last).into())).collect(),
            grow: table.grow,
            action,
        };
        let heads = |row: &Vec<Quad>| row[s * n..=s * n + last].iter().map(|e| e.0).collect();
        Some(LinearStages { map, accelerations: solution.rows.iter().map(heads).collect() })
    }
}

/// The solved equations of the stage accelerations, which are followed by the right-hand sides in each row.
struct Solution<'a> {
    table: &'a Condensed,
    n: usize,
    rows: Vec<Vec<Quad>>,
}

impl Solution<'_> {
    /// The sum of the accelerations of a coordinate over the stages, multiplied by weights, for one right-hand side.
    fn sum(&self, w: &[Quad], d: usize, side: usize) -> Quad {
        let (s, n) = (self.table.s, self.n);
        (0..s).fold(Quad::zero(), |sum, j| sum + w[j] * self.rows[j * n + d][s * n + side])
    }

    /// The change of the action, from the derivatives of L at the start, and its gradient and value at rest at the
    /// reference point.
    fn action(
        &self,
        PointDerivatives { qq, qv, vv, .. }: &PointDerivatives,
        at_place: &PointGradient,
        rest: f64,
        place: Vec<f64>,
    ) -> Action {
        let (table, n, one) = (self.table, self.n, Quad::one());
        let exact = &table.exact;
        let from_place = 2 * n + 1;
        // The stages as affine functions of (q0, v0, 1), with positions relative to the reference point, and the
        // weighted sum of L over them.
        let position = |i: usize, d: usize, side: usize| {
            unit(side == d, one) + unit(side == n + d, table.u[i]) + self.sum(&table.b[i], d, side)
        };
        let velocity = |i: usize, d: usize, side: usize| {
            unit(side == n + d, exact.inverse_rho[i]) + self.sum(&exact.d[i], d, side)
        };
        let stages = |of: &dyn Fn(usize, usize, usize) -> Quad| -> Vec<Vec<f64>> {
            let heads = |i: usize, side: usize| (0..n).map(|d| of(i, d, side).0).collect();
            (0..table.s).flat_map(|i| (0..=from_place).map(move |side| heads(i, side))).collect()
        };
        let (positions, velocities) = (stages(&position), stages(&velocity));
        let form = |a: usize, b: usize| {
            let mut image = vec![0.0; n];
            let mut pairing = |x: &[f64], m: &DMatrix<f64>, y: &[f64]| {
                product(m, y, &mut image);
                dot(x, &image)
            };
            (0..table.s).fold(0.0, |total, i| {
                let [x, y] = [&positions, &velocities].map(|stages| &stages[i * (from_place + 1)..]);
                let (xa, xb, ya, yb) = (&x[a], &x[b], &y[a], &y[b]);
                let second = pairing(xa, qq, xb) + pairing(ya, vv, yb) + pairing(xa, qv, yb) + pairing(xb, qv, ya);
                let linear = if b == from_place { dot(&at_place.q, xa) + dot(&at_place.v, ya) } else { 0.0 };
                let (half, once) =
                    if a == from_place { (0.5, rest) } else { (if b == from_place { 1.0 } else { 0.5 }, 0.0) };
                total + exact.end_v[i].0 * (half * second + linear + once)
            })
        };
        let quadratic = |a: usize, b: usize| [form(a, b), 2.0 * form(a, n + b), form(n + a, n + b)];
        Action {
            equilibrium_position: place,
            quadratic: (0..n * n).map(|index| quadratic(index / n, index % n)).collect(),
            linear: (0..n).map(|a| [form(a, from_place), form(n + a, from_place)]).collect(),
            constant: form(from_place, from_place),
        }
    }
}
