//! The Jacobian of the stage equations of contact Gauss collocation, as a sparse matrix with a border.

use super::border::Border;
use super::pattern::{FullPattern, Pattern};
use crate::AssemblyError;
use crate::local::{First, Place, Second};
use crate::system::AssembledSystem;

/// The maximum number of stages.
pub(crate) const MOST: usize = 2;

/// The coefficients of Gauss collocation with one or two stages. All except `ahead` are multiplied by the step size.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub s: usize,
    pub a: [[f64; MOST]; MOST],
    pub b: [f64; MOST],
    pub c: [f64; MOST],
    /// Extrapolation: the values, at the nodes of the next step, of the polynomial through the values at the nodes of
    /// this step.
    pub ahead: [[f64; MOST]; MOST],
}

impl Table {
    /// The coefficients for `s` stages, one or two.
    pub fn new(s: usize, h: f64) -> Self {
        if s == 1 {
            let only = |x: f64| [x, 0.0];
            return Table {
                s,
                a: [only(0.5 * h), [0.0; 2]],
                b: only(h),
                c: only(0.5 * h),
                ahead: [only(1.0), [0.0; 2]],
            };
        }
        let r = 3f64.sqrt() / 6.0;
        let (c, w) = ([0.5 - r, 0.5 + r], 0.5 / r);
        let ahead = c.map(|c_i| {
            let x = 1.0 + c_i;
            [(c[1] - x) * w, (x - c[0]) * w]
        });
        let a = [[0.25, 0.25 - r], [0.25 + r, 0.25]].map(|row| row.map(|a| a * h));
        Table { s: 2, a, b: [0.5 * h; 2], c: c.map(|c| c * h), ahead }
    }

    /// Solves `x_i + h sum a_ij w_j x_j = r_i` for the stages.
    fn solve(&self, w: [f64; MOST], r: [f64; MOST]) -> [f64; MOST] {
        let [[a, b], [c, d]]: [[f64; MOST]; MOST] = std::array::from_fn(|i| {
            std::array::from_fn(|j| f64::from(u8::from(i == j)) + if j < self.s { self.a[i][j] * w[j] } else { 0.0 })
        });
        let determinant = a * d - b * c;
        [(d * r[0] - b * r[1]) / determinant, (a * r[1] - c * r[0]) / determinant]
    }

    /// The integrating factors of the stages for given rates `L_z` there: `rho_i = 1 - h sum a_ij rho_j rate_j`.
    pub fn factors(&self, rates: [f64; MOST]) -> [f64; MOST] {
        self.solve(rates, [1.0; MOST])
    }

    /// The actions `Z_i - z0` of the stages for an L that is affine in z with these rates, from its values at z = z0.
    pub fn actions(&self, rates: [f64; MOST], values: [f64; MOST]) -> [f64; MOST] {
        let sums = self.a.map(|row| row.iter().zip(values).take(self.s).map(|(a, l)| a * l).sum());
        self.solve(rates.map(|rate| -rate), sums)
    }
}

/// The second derivatives of a system at one stage at a time, and their assembly into the Jacobian.
pub(crate) struct Assembly {
    pub pattern: FullPattern,
    /// The indices of the second derivatives of the potentials in `lower`, and of those of the general terms in
    /// `second`.
    potentials: Vec<Vec<u32>>,
    locals: Vec<Vec<u32>>,
    lower: Vec<f64>,
    second: Second,
}

impl Assembly {
    /// Determines the pattern.
    ///
    /// # Errors
    /// [`AssemblyError::Unknowns`] if there are more entries than 32-bit indices allow.
    pub fn new(system: &AssembledSystem) -> Result<Self, AssemblyError> {
        let n = system.unknowns();
        let triangle = Pattern::new(n, |f| {
            system.potentials.iter().for_each(|list| list.visit(f));
            system.locals.iter().for_each(|list| list.visit(f));
        })?;
        let pattern = FullPattern::new(&triangle)?;
        let potentials = system.potentials.iter().map(|list| list.entries(&triangle)).collect();
        let locals: Vec<Vec<u32>> = system.locals.iter().map(|list| list.entries(&pattern)).collect();
        let second = if locals.is_empty() { Second::default() } else { Second::zeros(n, pattern.rows.len()) };
        Ok(Assembly { potentials, locals, lower: vec![0.0; triangle.rows.len()], second, pattern })
    }

    /// Evaluates the second derivatives at a point.
    fn evaluate(&mut self, system: &AssembledSystem, at: Place) {
        self.lower.fill(0.0);
        for (list, places) in system.potentials.iter().zip(&self.potentials) {
            list.hessian(at.t, at.q, -1.0, places, &mut self.lower);
        }
        self.second.clear();
        for (list, places) in system.locals.iter().zip(&self.locals) {
            list.second(at, places, &mut self.second);
        }
    }

    /// Computes the entries of `L_vv` at a point.
    pub fn mass_matrix(&mut self, system: &AssembledSystem, at: Place, entries: &mut [f64]) {
        self.evaluate(system, at);
        for (column, range) in self.pattern.columns() {
            for e in range {
                let diagonal = self.pattern.rows[e] as usize == column;
                let mass = if diagonal { system.mass(column) } else { 0.0 };
                entries[e] = mass + self.second.vv.get(e).copied().unwrap_or(0.0);
            }
        }
    }

    /// Adds the contribution of the stage j, with its first derivatives, to the Jacobian, and to its border if there is
    /// one:
    ///
    /// `dR_i/dV_k = delta_ik rho_i L_vv + h a_ik (rho_i L_vq - rho_k L_qv) - h^2 sum_j a_ij a_jk rho_j L_qq`.
    #[expect(clippy::too_many_arguments, reason = "what the formula has, and where its sum goes")]
    pub fn add_stage(
        &mut self,
        system: &AssembledSystem,
        table: &Table,
        at: Place,
        j: usize,
        rho: f64,
        first: &First,
        entries: &mut [f64],
        border: Option<&mut Border>,
    ) {
        self.evaluate(system, at);
        let Assembly { pattern, lower, second, locals, .. } = self;
        let (s, a) = (table.s, &table.a);
        let general = !locals.is_empty();
        for (column, range) in pattern.columns() {
            let (begin, width) = (range.start * s * s, range.len() * s);
            for (offset, e) in range.enumerate() {
                let mass = if pattern.rows[e] as usize == column { system.mass(column) } else { 0.0 };
                let mut qq = lower[pattern.lower[e] as usize];
                let (mut vv, mut qv, mut vq) = (mass, 0.0, 0.0);
                if general {
                    qq += second.qq[e];
                    vv += second.vv[e];
                    (qv, vq) = (second.qv[e], second.vq[e]);
                }
                for k in 0..s {
                    for i in 0..s {
                        let mut entry = -a[i][j] * a[j][k] * qq;
                        if i == j {
                            entry += a[j][k] * vq;
                        }
                        if k == j {
                            entry -= a[i][j] * qv;
                        }
                        if i == j && k == j {
                            entry += vv;
                        }
                        entries[begin + k * width + offset * s + i] += rho * entry;
                    }
                }
            }
        }
        if let Some(border) = border {
            border.add_stage(table, j, rho, first, second);
        }
    }
}
