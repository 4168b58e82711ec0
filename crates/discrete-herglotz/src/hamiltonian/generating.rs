//! Generating functions of types II and III: contact symplectic Euler, its adjoint, and their compositions.

use super::increment::{ContactIncrement, jacobian};
use super::map_stepper::{ContactMaps, MapStepper, StateSums};
use crate::integration::StepFormula;
use crate::{
    InputError, Integrator, MethodInfo, PlanEntry, Problem, SplittingScheme, StepError, Stepper, StepperOptions,
};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::numbers::dot;
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};
use contact_geom::support::linear;
use contact_geom::{ChartVector, ContactHamiltonian, HamiltonianDerivatives, OfHamiltonian, PhasePoint, Scalar};

/// The largest number of iterations of Newton's method.
const MAX_ITERATIONS: u32 = 50;
/// The largest number of corrections with the last matrix: each corrects one order of the differentials.
const MAX_CORRECTIONS: u32 = 12;
/// Newton's method ends at corrections of this relative size: the rest is left to the corrections with the last matrix.
const NEWTON_TOLERANCE: f64 = 1e-8;
/// The relative size of corrections that are round-off.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;
/// Corrections of this relative size that no longer decrease are round-off too, that of the terms of H.
const PLATEAU: f64 = 1e-11;

/// Contact symplectic Euler, its adjoint, and symmetric compositions of both, for every contact Hamiltonian, whatever
/// the rank of `H_pp`. Each step is conformally contact. For `H = T(p) + V(q)` the maps are explicit: a kick and a
/// drift, or a drift and a kick. The theory is in docs/theory.md, sections 11.5 and 11.6.
///
/// ```
/// use discrete_herglotz::{SplittingScheme, hamiltonian::ContactEuler};
/// let method = ContactEuler::Symmetric(SplittingScheme::KAHAN_LI_6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactEuler {
    /// One step of type II, of order 1.
    TypeTwo,
    /// One step of the adjoint, of type III, of order 1.
    TypeThree,
    /// Type II over half a step and then its adjoint over the other half, of order 2, in a composition.
    Symmetric(SplittingScheme),
}

impl ContactEuler {
    /// The maps of a step in their order.
    fn maps(&self) -> Result<Vec<PartOfStep>, InputError> {
        let mut maps = Vec::new();
        match self {
            ContactEuler::TypeTwo => maps.push((Two, 0.0, 1.0)),
            ContactEuler::TypeThree => maps.push((Three, 0.0, 1.0)),
            ContactEuler::Symmetric(scheme) => {
                let (mut start, hypothesis) =
                    (0.0, "a composition of symmetric maps, not a Runge-Kutta-Nyström scheme");
                for g in scheme.substeps().ok_or(InputError::Hypothesis { hypothesis })?.iter() {
                    let half = 0.5 * g;
                    maps.extend([(Two, start, half), (Three, start + half, half)]);
                    start += g;
                }
            }
        }
        Ok(maps)
    }
}

/// The type of a map, and its start and its length as fractions of the step.
type PartOfStep = (GeneratingType, f64, f64);

impl<H: ContactHamiltonian<N>, const N: usize> ContactMaps<N> for (H, Vec<PartOfStep>) {
    fn add_step(&self, t: f64, h: f64, sums: &mut StateSums<N>, evaluations: &mut u64) -> Result<(), StepError> {
        for &(of_type, start, length) in &self.1 {
            sums.add(&generated_step(&self.0, of_type, (t + start * h, length * h), &sums.state(), evaluations)?);
        }
        Ok(())
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        vec![
            PlanEntry::computed("Newton's method", "p1, or (q1, z1), is defined implicitly"),
            PlanEntry::computed("action z", "generating functions give maps of (q, p, z)"),
        ]
    }
}

impl<'a, H: ContactHamiltonian<N>, const N: usize> Integrator<'a, OfHamiltonian<H>, N> for ContactEuler {
    fn info(&self) -> MethodInfo {
        let (suffix, order, symmetric, substeps) = match self {
            ContactEuler::TypeTwo => ("type_2", 1, false, false),
            ContactEuler::TypeThree => ("type_3", 1, false, false),
            ContactEuler::Symmetric(scheme) => (scheme.name(), scheme.order(), true, scheme.stages() > 1),
        };
        MethodInfo {
            symmetric,
            substeps,
            source:
                "Lall and West, J. Phys. A 39 (2006) 5509-5519; Leok and Zhang, IMA J. Numer. Anal. 31 (2011) 1497-1532"
                    .into(),
            // First and second derivatives, of which the latter take longer with the dimension.
            cost_per_evaluation: 2 + 2 * N as u64,
            ..MethodInfo::of_discrete::<1>(format!("contact_euler_{suffix}"), order)
        }
    }

    fn check(&self, _hamiltonian: &OfHamiltonian<H>) -> Result<(), InputError> {
        self.maps().map(|_| ())
    }

    /// The first step is taken once, as a check.
    fn stepper(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        _options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        let stepper = MapStepper::of((&problem.lagrangian.0, self.maps()?), h, problem.t0, &problem.state)?;
        stepper.maps.add_step(problem.t0, h, &mut { stepper.sums }, &mut 0).map_err(InputError::first_step)?;
        Ok(Box::new(stepper))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Jacobian)
    }

    fn step_jacobian(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        (t, from, _to): (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        let Ok(maps) = self.maps() else { return Ok(None) };
        let step = |x: &_| {
            maps.iter().try_fold(*x, |x, &(of_type, start, length)| {
                Ok(generated_step(&problem.lagrangian.0, of_type, (t + start * h, length * h), &x, &mut 0)?.after(&x))
            })
        };
        jacobian(from, step).map(Some)
    }
}

/// The type of the generating function of a step. Each type gives a conformally contact map, and the map of one type
/// over -h is the inverse of that of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GeneratingType {
    /// `H+(q0, p1, z0) = p1 . q0 + S`: with the derivatives of S there `q1 = q0 + S_p`, `p1 = p0 - S_q - p0 S_z`,
    /// `z1 = z0 + p1 . S_p - S`, `sigma = 1 - S_z`. The equations are solved for `p1`.
    Two,
    /// `H-(p0, q1, z1) = -p0 . q1 + S`: with the derivatives of S there `q1 = q0 + S_p`, `z1 = z0 + p0 . S_p - S`,
    /// `(1 + S_z) p1 = p0 - S_q`, `sigma = 1/(1 + S_z)`. The equations are solved for `(q1, z1)`.
    Three,
}
use GeneratingType::{Three, Two};

/// The equations of a step from a state, where H is evaluated at the time t.
struct Equations<'a, H, const N: usize, T> {
    hamiltonian: &'a H,
    of_type: GeneratingType,
    t: f64,
    h: f64,
    from: PhasePoint<N, T>,
}

/// The linear equations of a correction with w eliminated: of type III `(1 - S_pq) u - S_pz w = r`,
/// `(S_q - p0) u + (1 + S_z) w = s`; of type II `(1 + S_qp + p0 S_pz^T) u = r`.
struct Linear<const N: usize> {
    inverse: SMatrix<f64, N, N>,
    pz: SVector<f64, N>,
    row: SVector<f64, N>,
    corner: f64,
}

impl<H: ContactHamiltonian<N>, T: Scalar, const N: usize> Equations<'_, H, N, T> {
    /// S with its derivatives at the arguments of the type, and the residuals `(r, s)`.
    fn residuals(&self, at: &PhasePoint<N, T>) -> ((T, ChartVector<N, T>), (SVector<T, N>, T)) {
        let (value, d) = self.hamiltonian.with_gradient(T::from(self.t), at);
        let (value, d, from) = (value * self.h, d.scale(T::from(self.h)), &self.from);
        let residuals = match self.of_type {
            Two => (SVector::from_fn(|i, _| (at.p[i] - from.p[i]) + (d.x[i] + from.p[i] * d.z)), T::zero()),
            Three => (at.q - from.q - d.y, (at.z - from.z) - from.p.dot(&(at.q - from.q)) + value),
        };
        ((value, d), residuals)
    }

    /// A state without the error `(u, w)` of its unknowns.
    fn corrected(&self, at: PhasePoint<N, T>, (u, w): (SVector<T, N>, T)) -> PhasePoint<N, T> {
        match self.of_type {
            Two => PhasePoint { p: at.p - u, ..at },
            Three => PhasePoint { q: at.q - u, z: at.z - w, ..at },
        }
    }

    /// The size of a correction, relative to the state.
    fn size(&self, (u, w): (SVector<T, N>, T), at: &PhasePoint<N, T>, (value, d): &(T, ChartVector<N, T>)) -> f64 {
        let largest = |v: &SVector<T, N>| max_abs_or_nan(v.iter().map(|e| e.extent()));
        let scale = |sizes: [f64; 3]| max_or_nan(max_abs_or_nan(sizes), f64::MIN_POSITIVE);
        if self.of_type == Two {
            return largest(&u) / scale([&at.p, &self.from.p, &d.x].map(largest));
        }
        let terms = [largest(&at.p.component_mul(&d.y)), at.z.extent(), value.extent()];
        max_or_nan(largest(&u) / scale([largest(&at.q), largest(&d.y), 0.0]), w.extent() / scale(terms))
    }

    /// The increment of the state from S at the solved arguments.
    fn change(&self, at: &PhasePoint<N, T>, of: (T, ChartVector<N, T>)) -> Result<ContactIncrement<N, T>, StepError> {
        let ((value, d), one) = (of, T::one());
        let (over, sigma) = if self.of_type == Two { (one, one - d.z) } else { (d.z + 1.0, (d.z + 1.0).recip()) };
        if sigma.re() <= 0.0 || over.re() == 0.0 {
            return Err(StepError::SigmaVanished { sigma: sigma.re() });
        }
        // The p of the arguments is p1 for type II, p0 for type III. The increment of the action may overflow.
        let z = dot(at.p, d.y) - value;
        if !z.re().is_finite() {
            return Err(StepError::NonFinite);
        }
        let p = SVector::from_fn(|i, _| -(d.x[i] + self.from.p[i] * d.z) / over);
        Ok(ContactIncrement { q: d.y, p, z, sigma_minus_one: -d.z / over })
    }
}

impl<H: ContactHamiltonian<N>, const N: usize> Equations<'_, H, N, f64> {
    /// The linear equations at a state where S has the derivatives d.
    fn linear(&self, at: &PhasePoint<N>, d: &ChartVector<N>) -> Result<Linear<N>, StepError> {
        let second = self.hamiltonian.hessian(self.t, at);
        let (qv, vz, one) = (second.qv * self.h, second.vz * self.h, SMatrix::<f64, N, N>::identity());
        let (row, corner) = (d.x - at.p, 1.0 + d.z);
        let (matrix, pz, row, corner) = match self.of_type {
            Two => (qv + self.from.p * vz.transpose() + one, SVector::zeros(), SVector::zeros(), 1.0),
            Three => (one - qv.transpose() + vz * row.transpose() / corner, vz, row, corner),
        };
        if !matrix.iter().all(|e| e.is_finite()) {
            return Err(if corner == 0.0 { StepError::Singular { pivot: 0.0 } } else { StepError::NonFinite });
        }
        let mut inverse = one;
        for mut column in inverse.column_iter_mut() {
            linear::solve(&mut matrix.clone(), &mut column).map_err(|e| StepError::Singular { pivot: e.pivot })?;
        }
        Ok(Linear { inverse, pz, row, corner })
    }
}

impl<const N: usize> Linear<N> {
    fn solve<T: Scalar>(&self, (r, s): (SVector<T, N>, T)) -> (SVector<T, N>, T) {
        let right = SVector::<T, N>::from_fn(|i, _| r[i] + s * (self.pz[i] / self.corner));
        let u = SVector::from_fn(|i, _| (0..N).fold(T::zero(), |sum, j| sum + right[j] * self.inverse[(i, j)]));
        (u, (0..N).fold(s, |sum, j| sum - u[j] * self.row[j]) / self.corner)
    }
}

/// The step of length h from the time t by the generating function with the increment `S = h H`, of type II with H at the
/// start of the step or of type III with H at its end: contact symplectic Euler, of order 1, or its adjoint. Any
/// generating function is of this form, with `H = S/h`. Adds the number of evaluations of derivatives to a counter.
pub(super) fn generated_step<H: ContactHamiltonian<N>, T: Scalar, const N: usize>(
    hamiltonian: &H,
    of_type: GeneratingType,
    (t, h): (f64, f64),
    x: &PhasePoint<N, T>,
    evaluations: &mut u64,
) -> Result<ContactIncrement<N, T>, StepError> {
    let t = if of_type == Two { t } else { t + h };
    let from = PhasePoint { q: x.q.map(|e| e.re()), p: x.p.map(|e| e.re()), z: x.z.re() };
    let equations = Equations { hamiltonian, of_type, t, h, from };
    let (mut at, mut iterations) = (from, 0);
    let linear = loop {
        let (found, (r, s)) = equations.residuals(&at);
        let residual = max_or_nan(max_abs_or_nan(r.iter().copied()), s.abs());
        if !residual.is_finite() {
            return Err(StepError::NonFinite);
        }
        let linear = equations.linear(&at, &found.1)?;
        *evaluations += 2;
        let error = linear.solve((r, s));
        (at, iterations) = (equations.corrected(at, error), iterations + 1);
        if iterations >= MAX_ITERATIONS {
            return Err(StepError::NotConverged { residual, iterations });
        }
        if equations.size(error, &at, &found) <= NEWTON_TOLERANCE {
            break linear;
        }
    };
    // With the differentials, and to round-off.
    let equations = Equations { hamiltonian, of_type, t, h, from: *x };
    let mut at = match of_type {
        Two => PhasePoint { p: at.p.map(T::from), ..*x },
        Three => PhasePoint { q: at.q.map(T::from), p: x.p, z: T::from(at.z) },
    };
    let mut before = f64::INFINITY;
    for corrections in 0..=MAX_CORRECTIONS {
        let (found, residuals) = equations.residuals(&at);
        *evaluations += 1;
        let error = linear.solve(residuals);
        let size = equations.size(error, &at, &found);
        if size <= ROUND_OFF || (size <= PLATEAU && size >= 0.5 * before) {
            return equations.change(&at, found);
        }
        if !size.is_finite() {
            return Err(StepError::NonFinite);
        }
        if corrections < MAX_CORRECTIONS {
            (before, at) = (size, equations.corrected(at, error));
        }
    }
    Err(StepError::NotConverged { residual: before, iterations: iterations + MAX_CORRECTIONS })
}
