//! The discrete Herglotz equations along a path: their residuals, and Newton's correction by block elimination and back
//! substitution.

use super::elimination::{ActionRow, BlockRows, Panel, back_substitute};
use super::end::Conditions;
use super::herglotz_equation::HerglotzEquation;
use super::step_forces::StepForces;
use crate::{DiscreteLagrangian, StepError};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{DiscretePoint, SecondDiscreteJet, numbers::max_or_nan, support::linear};

/// The positions and actions of a path.
#[derive(Clone)]
pub(super) struct Nodes<const N: usize> {
    pub q: Vec<SVector<f64, N>>,
    pub z: Vec<f64>,
}

/// The eliminated equations at a point, `dq_k + next dq_{k+1} = rhs`, with further terms on the left where the
/// [`BlockElimination`] stores some for this point.
#[derive(Clone, Copy)]
pub(super) struct Eliminated<const N: usize> {
    pub next: SMatrix<f64, N, N>,
    pub rhs: SVector<f64, N>,
}

/// The momentum at the end of a step, with the derivative in the action.
#[derive(Clone, Copy)]
pub(super) struct Carry<const N: usize> {
    /// `D2 L_d + F+`, the momentum at the end of the step.
    pub p: SVector<f64, N>,
    /// `Dz L_d`.
    pub dz: f64,
    /// `sigma_d`.
    pub sigma: f64,
}

impl<const N: usize> Carry<N> {
    #[inline(always)]
    pub fn of<D: DiscreteLagrangian<N>>(jet: &SecondDiscreteJet<N>, forces: &StepForces<D, N>) -> Self {
        Carry { p: forces.momentum(jet), dz: jet.first.dz, sigma: jet.first.sigma() }
    }
}

/// The workspace of a block elimination, of a length proportional to that of the path.
pub(super) struct BlockElimination<const N: usize> {
    pub points: Vec<Eliminated<N>>,
    /// The matrices of `dq_{k+2}`, for the points k at which rows were exchanged with those of the next point.
    pub after: Vec<(usize, SMatrix<f64, N, N>)>,
    /// The matrices of `dq_0`, for a periodic path.
    first: Vec<SMatrix<f64, N, N>>,
    /// The correction of the last unknown position, which is `q_0` for a periodic path.
    last: SVector<f64, N>,
    /// The momenta along the path of the last elimination.
    pub momenta: Vec<Carry<N>>,
    /// Whether a momentum of a step has been found to depend on the action.
    pub coupled: bool,
}

/// Residuals and other measures of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured<const N: usize> {
    /// The largest residual of a discrete Herglotz equation or of a boundary condition, a momentum.
    pub residual: f64,
    /// The largest residual relative to the size of the terms of its equation.
    pub relative: f64,
    /// The sum of the squares of the residuals, for each coordinate.
    pub squares: SVector<f64, N>,
    /// The largest size of the terms of the equations, for each coordinate.
    pub sizes: SVector<f64, N>,
    /// The logarithm of the product of the sigma_d; NaN where one is negative.
    pub log_factor: f64,
    /// The product of the sigma_d that are not yet included in `log_factor`.
    pub factors: f64,
    /// The first step with a sigma_d that is not positive, and its value.
    pub not_contact: Option<(usize, f64)>,
    /// The smallest pivot of the last block relative to its diagonal before the elimination; 0 where a pivot vanishes.
    pub regularity: f64,
}

/// A step at which the discrete Lagrangian is not defined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Undefined {
    pub step: usize,
    pub cause: StepError,
}

/// The equations of a path.
pub(super) struct Equations<'a, D, const N: usize> {
    pub ld: &'a D,
    pub conditions: &'a Conditions<N>,
    pub t0: f64,
    pub steps: usize,
    /// A load that is added to the equation of the point at the start of each step; zero for the steps beyond its
    /// length.
    pub load: &'a [SVector<f64, N>],
}

impl<D: DiscreteLagrangian<N>, const N: usize> Equations<'_, D, N> {
    /// The momentum at the end of a path. Sets the actions of the path.
    fn last_momentum(&self, x: &mut Nodes<N>) -> Result<SVector<f64, N>, Undefined> {
        let mut p = SVector::zeros();
        for k in 0..self.steps {
            let point = DiscretePoint { q0: x.q[k], q1: x.q[k + 1], z0: x.z[k] };
            let undefined = |cause| Undefined { step: k, cause };
            let t = self.t0 + k as f64 * self.ld.step_size();
            let jet = self.ld.jet(t, &point).map_err(undefined)?;
            p = jet.d2;
            if const { D::FORCED } && k + 1 == self.steps && self.ld.has_forces() {
                p += self.ld.forces(t, &point).map_err(undefined)?[1];
            }
            x.z[k + 1] = x.z[k] + jet.value;
        }
        Ok(p)
    }

    /// The discrete forces of a step, with finite entries.
    #[inline(always)]
    fn forces(
        &self,
        k: usize,
        q0: &SVector<f64, N>,
        q1: &SVector<f64, N>,
        z0: f64,
    ) -> Result<StepForces<D, N>, Undefined> {
        let t = self.t0 + k as f64 * self.ld.step_size();
        let forces = StepForces::at(self.ld, t, &DiscretePoint { q0: *q0, q1: *q1, z0 });
        let forces = forces.map_err(|cause| Undefined { step: k, cause })?;
        if forces.is_finite() { Ok(forces) } else { Err(Undefined { step: k, cause: StepError::NonFinite }) }
    }

    /// The second jet of a step, with finite entries. It is not inlined, unlike in the elimination
    /// [without exchanges](BlockElimination::without_exchanges), because the elimination with exchanges is rare.
    #[inline(never)]
    pub fn jet(
        &self,
        k: usize,
        q0: &SVector<f64, N>,
        q1: &SVector<f64, N>,
        z0: f64,
    ) -> Result<SecondDiscreteJet<N>, Undefined> {
        let t = self.t0 + k as f64 * self.ld.step_size();
        let jet = self.ld.second_jet(t, &DiscretePoint { q0: *q0, q1: *q1, z0 });
        let mut jet = jet.map_err(|cause| Undefined { step: k, cause })?;
        if let Some(load) = self.load.get(k) {
            jet.first.d1 += load;
        }
        let second = jet.d11.sum() + jet.d12.sum() + jet.d22.sum() + jet.d1z.sum() + jet.d2z.sum() + jet.dzz;
        let first = jet.first.value + jet.first.d1.sum() + jet.first.d2.sum() + jet.first.dz;
        // The product with zero is zero unless an entry is infinite or NaN, or a sum overflows.
        if (first + second) * 0.0 == 0.0 { Ok(jet) } else { Err(Undefined { step: k, cause: StepError::NonFinite }) }
    }
}

impl<const N: usize> Measured<N> {
    pub fn new() -> Self {
        Measured {
            residual: 0.0,
            relative: 0.0,
            squares: SVector::zeros(),
            sizes: SVector::zeros(),
            log_factor: 0.0,
            factors: 1.0,
            not_contact: None,
            regularity: 0.0,
        }
    }

    /// Includes a residual, given with the sizes of its terms.
    #[inline(always)]
    pub fn take(&mut self, value: &SVector<f64, N>, size: &SVector<f64, N>) {
        // Few points exceed the maxima so far; for the others all coordinates are compared at once and without a
        // division. A NaN counts as exceeding.
        let mut within = true;
        for i in 0..N {
            let off = value[i].abs();
            self.squares[i] += off * off;
            self.sizes[i] = max_or_nan(self.sizes[i], size[i]);
            within &= (off <= self.relative * size[i]) & (off <= self.residual);
        }
        if !within {
            for (off, size) in value.iter().map(|x| x.abs()).zip(size) {
                self.residual = max_or_nan(self.residual, off);
                let within = off <= self.relative * size;
                if !within {
                    self.relative = max_or_nan(self.relative, off / size);
                }
            }
        }
    }

    #[inline(always)]
    pub fn factor(&mut self, step: usize, sigma: f64) {
        if sigma <= 0.0 && self.not_contact.is_none() {
            self.not_contact = Some((step, sigma));
        }
        if sigma < 0.0 {
            self.log_factor = f64::NAN;
        }
        // One logarithm is taken for many factors.
        self.factors *= sigma;
        if !(1e-100..1e100).contains(&self.factors) {
            self.log_factor += self.factors.ln();
            self.factors = 1.0;
        }
    }
}

impl<const N: usize> BlockElimination<N> {
    pub fn new<D>(of: &Equations<'_, D, N>) -> Self {
        let zero = SMatrix::zeros();
        let closed = if of.conditions.is_periodic() { of.steps } else { 0 };
        BlockElimination {
            points: vec![Eliminated { next: zero, rhs: SVector::zeros() }; of.steps],
            after: Vec::new(),
            first: vec![zero; closed],
            last: SVector::zeros(),
            momenta: vec![Carry { p: SVector::zeros(), dz: 0.0, sigma: 1.0 }; of.steps],
            coupled: false,
        }
    }

    /// Sets the actions of a path by their recursion, measures its residuals, and eliminates its linearised equations.
    ///
    /// The correction of an action is an affine function of those of the positions, which is carried along, so that the
    /// factorised blocks have N rows instead of N + 1. Rows of neighbouring points are exchanged only for periodic
    /// paths, and where the elimination [without exchanges](Self::without_exchanges) is not stable.
    pub fn forward<D: DiscreteLagrangian<N>>(
        &mut self,
        of: &Equations<'_, D, N>,
        x: &mut Nodes<N>,
    ) -> Result<Measured<N>, Undefined> {
        if !of.conditions.is_periodic()
            && let Some(measured) = self.without_exchanges(of, x)?
        {
            return Ok(measured);
        }
        self.with_exchanges(of, x)
    }

    /// The same with exchanges of rows between neighbouring points.
    fn with_exchanges<D: DiscreteLagrangian<N>>(
        &mut self,
        of: &Equations<'_, D, N>,
        x: &mut Nodes<N>,
    ) -> Result<Measured<N>, Undefined> {
        // `PERIODIC` is a constant, so that paths with given ends do not pay for the terms of periodic ones.
        if of.conditions.is_periodic() { self.forward_of::<D, true>(of, x) } else { self.forward_of::<D, false>(of, x) }
    }

    fn forward_of<D: DiscreteLagrangian<N>, const PERIODIC: bool>(
        &mut self,
        of: &Equations<'_, D, N>,
        x: &mut Nodes<N>,
    ) -> Result<Measured<N>, Undefined> {
        let steps = of.steps;
        self.after.clear();
        let mut measured = Measured::new();
        let mut now = of.jet(0, &x.q[0], &x.q[1], x.z[0])?;
        let mut forces = of.forces(0, &x.q[0], &x.q[1], x.z[0])?;
        let (start, end) = of.conditions.momenta();
        let mut panel = Panel::new(PERIODIC);
        if let Some(p) = &start {
            let at = HerglotzEquation::new(p, (&now, &forces), &x.q[1]);
            measured.take(&at.value, &at.size);
            panel.top = BlockRows { here: at.here, next: at.next, rhs: -at.value, ..BlockRows::zero() };
        }
        // The jet and the forces of the first step, for a periodic path; and whether no pivot has vanished so far.
        let (opening, opening_forces, mut regular) = (now, forces, true);
        let mut diagonal = SVector::<f64, N>::zeros();
        // The row of the action at point k; zero at the start, where the action is given.
        let mut action = ActionRow::zero();
        for k in 0..steps {
            measured.factor(k, now.first.sigma());
            self.momenta[k] = Carry::of(&now, &forces);
            x.z[k + 1] = x.z[k] + now.first.value;
            panel.action = action.recursion(&now.first);
            let ahead = if k + 1 < steps {
                let (q0, q1, z0) = (&x.q[k + 1], &x.q[k + 2], x.z[k + 1]);
                Some((of.jet(k + 1, q0, q1, z0)?, of.forces(k + 1, q0, q1, z0)?))
            } else {
                None
            };
            let p_next = forces.momentum(&now);
            let bottom = match (&ahead, &end) {
                (Some((jet, of_jet)), _) => {
                    let at = HerglotzEquation::new(&p_next, (jet, of_jet), &x.q[k + 2]);
                    Some((at, jet.first.sigma()))
                }
                (None, Some(p)) => Some((HerglotzEquation::at_end(p, (&now, &forces), &x.q[k]), 1.0)),
                // The momentum at the end of a periodic path is that of its start.
                (None, None) if PERIODIC => {
                    let at = HerglotzEquation::new(&p_next, (&opening, &opening_forces), &x.q[1]);
                    // Its derivatives in the first two positions were stored at the start of the elimination.
                    let (here, next) = (SMatrix::zeros(), SMatrix::zeros());
                    Some((HerglotzEquation { here, next, action: SVector::zeros(), ..at }, opening.first.sigma()))
                }
                (None, None) => None,
            };
            let Some((at, sigma)) = bottom else {
                // The last position is given, so that the last equation is that of the point before it.
                break;
            };
            measured.take(&at.value, &at.size);
            panel.bottom = at.rows::<D, PERIODIC>((&now, &forces), sigma, &action, &panel.action);
            diagonal = panel.bottom.next.diagonal().abs();
            if k == 0 && start.is_none() {
                // The first position is given, or it is the last unknown of a periodic path.
                if PERIODIC {
                    let last = of.last_momentum(x)?;
                    let at = HerglotzEquation::new(&last, (&opening, &opening_forces), &SVector::zeros());
                    panel.open(at.here, at.next);
                }
            } else {
                if PERIODIC && k + 1 == steps {
                    panel.close();
                }
                if regular {
                    match panel.eliminate::<PERIODIC>() {
                        Ok(exchanged) => self.keep(k, &panel, exchanged),
                        Err(_) => regular = false,
                    }
                }
            }
            panel.advance::<PERIODIC>();
            action = panel.action;
            if let Some(ahead) = ahead {
                (now, forces) = ahead;
            }
        }
        measured.log_factor += measured.factors.ln();
        if regular {
            measured.regularity = self.finish(&panel.top.here, &panel.top.rhs, &diagonal);
        }
        Ok(measured)
    }

    #[inline(always)]
    fn keep(&mut self, k: usize, panel: &Panel<N>, exchanged: bool) {
        let (mut next, mut rhs) = (panel.top.next, panel.top.rhs);
        let (u, inverses) = (&panel.top.here, &panel.inverses);
        back_substitute(u, inverses, &mut next);
        back_substitute(u, inverses, &mut rhs);
        if exchanged {
            let mut after = panel.top.after;
            back_substitute(u, inverses, &mut after);
            self.after.push((k, after));
        }
        if let Some(kept) = self.first.get_mut(k) {
            let mut first = panel.top.first;
            back_substitute(u, inverses, &mut first);
            *kept = first;
        }
        self.points[k] = Eliminated { next, rhs };
    }

    /// Solves for the last unknown position. Returns the smallest pivot relative to the diagonal before the
    /// elimination.
    pub fn finish(&mut self, here: &SMatrix<f64, N, N>, rhs: &SVector<f64, N>, diagonal: &SVector<f64, N>) -> f64 {
        // The block is scaled so that its diagonal before the elimination is 1, which makes the pivots comparable.
        let unit = diagonal.map(|size| if size > 0.0 { size.sqrt().recip() } else { 1.0 });
        let mut scaled = SMatrix::<f64, N, N>::from_fn(|i, j| here[(i, j)] * unit[i] * unit[j]);
        self.last = rhs.component_mul(&unit);
        let regularity = match linear::solve(&mut scaled, &mut self.last) {
            Ok(_) => (0..N).fold(1.0, |least: f64, i| least.min(scaled[(i, i)].abs())),
            Err(_) => 0.0,
        };
        self.last.component_mul_assign(&unit);
        regularity
    }

    /// Back substitution from the last point to the first: writes the corrected path, and returns the sizes of the
    /// corrections.
    pub fn backward<D>(
        &self,
        of: &Equations<'_, D, N>,
        from: &[SVector<f64, N>],
        to: &mut [SVector<f64, N>],
    ) -> Extent<N> {
        let steps = of.steps;
        let mut exchanged = self.after.iter().rev().peekable();
        let zero = SVector::<f64, N>::zeros();
        let (last, closed) = match of.conditions {
            Conditions::Ends(_, end) if end.position().is_some() => (steps - 1, zero),
            Conditions::Ends(..) => (steps, zero),
            Conditions::Periodic(_) => (steps, self.last),
        };
        let mut extent = Extent { change: zero, positions: zero };
        let (mut next, mut after) = (zero, zero);
        for k in (0..=steps).rev() {
            let mut dq = zero;
            if k == last {
                dq = self.last;
            } else if let Some(point) = self.points.get(k) {
                dq = point.rhs;
                for c in 0..N {
                    for i in 0..N {
                        dq[i] -= point.next[(i, c)] * next[c];
                    }
                }
                if let Some((_, by)) = exchanged.next_if(|(at, _)| *at == k) {
                    dq -= by * after;
                }
                if let Some(by) = self.first.get(k) {
                    dq -= by * closed;
                }
            }
            // The first point of a periodic path is the last one up to the shift.
            if k == 0 && of.conditions.is_periodic() {
                dq = closed;
            }
            to[k] = from[k] + dq;
            extent.take(&from[k], &dq);
            (after, next) = (next, dq);
        }
        extent
    }
}

/// The sizes of the corrections and of the corrected path.
pub(super) struct Extent<const N: usize> {
    /// The largest correction of each coordinate.
    pub change: SVector<f64, N>,
    /// The largest absolute value of each coordinate.
    pub positions: SVector<f64, N>,
}

impl<const N: usize> Extent<N> {
    #[inline(always)]
    fn take(&mut self, q: &SVector<f64, N>, dq: &SVector<f64, N>) {
        // A NaN is ignored here; it shows in the equations of the corrected path.
        for i in 0..N {
            let (off, size) = (dq[i].abs(), q[i].abs() + dq[i].abs());
            self.change[i] = if off > self.change[i] { off } else { self.change[i] };
            self.positions[i] = if size > self.positions[i] { size } else { self.positions[i] };
        }
    }

    /// The largest correction of a coordinate relative to the size of that coordinate along this path or the `first`
    /// one.
    pub fn relative(&self, first: &SVector<f64, N>) -> f64 {
        let size = self.positions.sup(first);
        (0..N).filter(|&i| self.change[i] != 0.0).fold(0.0, |worst, i| max_or_nan(worst, self.change[i] / size[i]))
    }
}
