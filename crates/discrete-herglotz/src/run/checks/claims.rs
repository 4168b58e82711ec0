//! Claims of structure along a run: quantities that are claimed to be constant are compared with their values at the
//! start.

use crate::integration::hermite;
use crate::resolution::monitor::size;
use crate::resolution::thresholds::{CLAIM_ROUNDINGS, MAX_CONSTANT_DIFFERENCE, MIN_CLAIM_DISPLACEMENT};
use crate::run::discretization::Discretization;
use crate::{Point, State, Stepper, System, Vector};
use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};
use contact_geom::{Defect, Structure};

/// The number of parts into which a step is divided for checks within it, if its own displacement exceeds
/// [`MIN_CLAIM_DISPLACEMENT`]: a step that spans the whole motion has parts of about this displacement.
const PARTS_OF_A_STEP: usize = 8;

/// The number of steps in each doubling of the number of steps after which checks are due: their cost is then a fixed
/// number of steps for each doubling, also in long runs.
const CHECKS_PER_DOUBLING: usize = 8;

/// Compares the quantities that are claimed to be constant (the mass matrix, `L_z` and second derivatives) with their
/// values at the start of a run. Checks are due after [`CHECKS_PER_DOUBLING`] steps in each doubling of the number of
/// steps; they are made if the motion has moved by a given part of its extent since the last one, so that the distance
/// between two checks is about that part. A step whose own displacement exceeds it is checked at points within the
/// step.
///
/// A check costs about as much as a step. [`Structure::defects`] checks more, and is evaluated less often.
pub(crate) struct ClaimMonitor {
    structure: Structure,
    /// The values at the start. `None` for a system that depends on time: its values are evaluated at the initial state
    /// and the current time.
    reference: Option<Constants>,
    /// The bounding box of the motion so far, and the state at the last check.
    low: [Vector; 2],
    high: [Vector; 2],
    last: [Vector; 2],
    guess: Vector,
}

/// The quantities that are claimed to be constant.
struct Constants {
    rate: f64,
    mass: DMatrix<f64>,
    qq: Option<DMatrix<f64>>,
}

impl Constants {
    fn at(structure: &Structure, system: &dyn System, t: f64, x: &Point) -> Option<Self> {
        let rate = system.gradient(t, x).z;
        let constants = if structure.quadratic {
            let h = system.hessian(t, x);
            Constants { rate, mass: h.vv, qq: Some(h.qq) }
        } else {
            Constants { rate, mass: system.mass_matrix(t, x), qq: None }
        };
        let entries = constants.mass.iter().chain(constants.qq.iter().flatten());
        let finite = constants.rate.is_finite() && entries.into_iter().all(|e| e.is_finite());
        finite.then_some(constants)
    }
}

impl ClaimMonitor {
    /// The monitor of a run whose Lagrangian claims that something is constant. `None` if the claims are proved.
    pub fn of(steps: &Discretization<'_>) -> Option<Self> {
        let problem = &steps.problem;
        let hints = problem.system.hints();
        // A Hamiltonian's own claims are verified at the start of the run.
        if hints.proved || hints.hamiltonian {
            return None;
        }
        let structure = problem.structure;
        if !(structure.is_affine_in_z() || structure.separable || structure.constant_mass || structure.quadratic) {
            return None;
        }
        let here = [problem.state.q.clone(), problem.state.p.clone()];
        // The coefficients of a quadratic Lagrangian may depend on time.
        let reference = structure.autonomous || structure.z_free && structure.constant_mass && !structure.quadratic;
        let reference = if reference {
            Some(Constants::at(&structure, &*problem.system, problem.t0, &problem.start)?)
        } else {
            None
        };
        let guess = problem.start.v.clone();
        Some(ClaimMonitor { structure, reference, low: here.clone(), high: here.clone(), last: here, guess })
    }

    /// The number of steps after which the next check is due.
    pub fn next(&self, taken: usize) -> usize {
        taken.saturating_add((taken / CHECKS_PER_DOUBLING).max(1))
    }

    /// Checks the claims at the end of a step, and within a long step; returns a violated claim.
    pub fn violated(
        &mut self,
        steps: &Discretization<'_>,
        stepper: &dyn Stepper,
        before: Option<&(f64, State)>,
    ) -> Option<Defect> {
        let (t, state) = (stepper.time(), stepper.state());
        if self.cover(&state) < MIN_CLAIM_DISPLACEMENT {
            return None;
        }
        self.last = [state.q.clone(), state.p.clone()];
        let (system, near) = (&*steps.problem.system, stepper.last_velocity());
        let x = system.legendre_inverse(t, &state, near.as_ref().unwrap_or(&self.guess)).ok()?;
        self.guess = x.v.clone();
        let fractions = (1..PARTS_OF_A_STEP).map(|i| i as f64 / PARTS_OF_A_STEP as f64);
        if let Some(curve) = stepper.dense() {
            let (start, end) = curve.span();
            let from = curve.at_fraction(0.0);
            if self.part([from.q - &state.q, from.p - &state.p]) > MIN_CLAIM_DISPLACEMENT {
                for fraction in fractions {
                    let (t, state) = (start + fraction * (end - start), curve.at_fraction(fraction));
                    let within = system.legendre_inverse(t, &state, &self.guess);
                    if let Some(defect) = within.ok().and_then(|x| self.compare(steps, t, &x)) {
                        return Some(defect);
                    }
                }
            }
        } else if let Some((start, from)) = before
            && self.part([&from.q - &state.q, &from.p - &state.p]) > MIN_CLAIM_DISPLACEMENT
            && let Ok(from) = system.legendre_inverse(*start, from, &self.guess)
        {
            for fraction in fractions {
                let at = fraction * (t - start);
                if let Some(defect) = self.compare(steps, start + at, &hermite(&from, &x, t - start, at)) {
                    return Some(defect);
                }
            }
        }
        self.compare(steps, t, &x)
    }

    /// Extends the bounding box by a state; returns its distance from the last check, relative to the box.
    fn cover(&mut self, state: &State) -> f64 {
        for (x, (low, high)) in [&state.q, &state.p].into_iter().zip(self.low.iter_mut().zip(&mut self.high)) {
            // States are finite here: a run ends at the first state that is not.
            for (x, (low, high)) in x.iter().zip(low.iter_mut().zip(high.iter_mut())) {
                *low = if *x < *low { *x } else { *low };
                *high = if *x > *high { *x } else { *high };
            }
        }
        self.part([&state.q - &self.last[0], &state.p - &self.last[1]])
    }

    /// A distance relative to the box: the largest ratio over all coordinates and momenta.
    fn part(&self, distance: [Vector; 2]) -> f64 {
        let mut part = 0.0;
        for (distance, (low, high)) in distance.iter().zip(self.low.iter().zip(&self.high)) {
            for (distance, (low, high)) in distance.iter().zip(low.iter().zip(high)) {
                if *distance != 0.0 {
                    part = max_or_nan(part, distance.abs() / (high - low));
                }
            }
        }
        part
    }

    fn compare(&self, steps: &Discretization<'_>, t: f64, x: &Point) -> Option<Defect> {
        let (system, structure) = (&*steps.problem.system, self.structure);
        let here = Constants::at(&structure, system, t, x)?;
        let then;
        let reference = match &self.reference {
            Some(reference) => reference,
            None => {
                then = Constants::at(&structure, system, t, &steps.problem.start)?;
                &then
            }
        };
        let rounding = |part: usize| {
            let (_, r) = system.rounding(t, x);
            CLAIM_ROUNDINGS * [size(&r.x) / size(&x.q), size(&r.y) / size(&x.v), r.z][part]
        };
        let mut found = None;
        let mut claim = |made: bool, claim: &'static str, part: usize, difference: Option<(f64, f64)>| {
            if let (true, None, Some((apart, size))) = (made, &found, difference)
                && apart > rounding(part)
            {
                found = Some(Defect { claim, size });
            }
        };
        let rate = difference(&[here.rate], &[reference.rate]);
        let Structure { z_free, z_affine, constant_rate, separable, quadratic, constant_mass, .. } = structure;
        claim(z_free, "z_free", 2, rate);
        claim(constant_rate, "constant_rate", 2, rate);
        claim(z_affine, "z_affine", 2, rate);
        let mass = difference(here.mass.as_slice(), reference.mass.as_slice());
        claim(constant_mass, "constant_mass", 1, mass);
        claim(separable, "separable", 1, mass);
        claim(quadratic, "quadratic", 1, mass);
        if let (Some(a), Some(b)) = (&here.qq, &reference.qq) {
            claim(true, "quadratic", 0, difference(a.as_slice(), b.as_slice()));
        }
        found
    }
}

/// The largest difference of two sets of numbers, absolute and relative to the largest number; `None` if the sets
/// agree.
fn difference(a: &[f64], b: &[f64]) -> Option<(f64, f64)> {
    let apart = max_abs_or_nan(a.iter().zip(b).map(|(a, b)| a - b));
    let size = max_abs_or_nan(a.iter().chain(b).copied());
    (apart > MAX_CONSTANT_DIFFERENCE * size).then(|| (apart, apart / size))
}
