//! Steppers of generating functions.

use super::{Adjoint, TypeTwo, type_three_step, type_two_step};
use crate::hamiltonian::ContactIncrement;
use crate::hamiltonian::map_stepper::{ContactMaps, MapStepper, StateSums};
use crate::{InputError, PlanEntry, SplittingScheme, StepError};
use contact_geom::{PhasePoint, Scalar};

/// How a step is made from a generating function of type II and its adjoint of type III.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrangement {
    /// One step of type II: order 1 for [`Euler`](super::Euler).
    TypeTwo,
    /// One step of the adjoint, of type III.
    TypeThree,
    /// The symmetric map of order 2, type II over half a step and then its adjoint over the other half, in a
    /// composition.
    Symmetric(SplittingScheme),
}

/// A map of a step: its type, its start and its length as fractions of the step.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartialStep {
    second_type: bool,
    start: f64,
    length: f64,
}

impl Arrangement {
    /// The maps of a step, in their order.
    pub(super) fn maps(&self) -> Result<Vec<PartialStep>, InputError> {
        let whole = |second_type| Ok(vec![PartialStep { second_type, start: 0.0, length: 1.0 }]);
        match self {
            Arrangement::TypeTwo => whole(true),
            Arrangement::TypeThree => whole(false),
            Arrangement::Symmetric(scheme) => {
                let substeps = scheme.substeps().ok_or(InputError::Hypothesis {
                    hypothesis: "a composition of symmetric maps, not a Runge-Kutta-Nyström scheme",
                })?;
                let mut start = 0.0;
                let pairs = substeps.iter().flat_map(|g| {
                    let half = |second_type, start| PartialStep { second_type, start, length: 0.5 * g };
                    let pair = [half(true, start), half(false, start + 0.5 * g)];
                    start += g;
                    pair
                });
                Ok(pairs.collect())
            }
        }
    }
}

/// The increment of a map of a step that starts at the time t.
pub(super) fn partial_step<G: TypeTwo<N>, T: Scalar, const N: usize>(
    function: &Adjoint<G>,
    map: &PartialStep,
    (t, h): (f64, f64),
    x: &PhasePoint<N, T>,
    evaluations: &mut u64,
) -> Result<ContactIncrement<N, T>, StepError> {
    let (t, h) = (t + map.start * h, map.length * h);
    if map.second_type {
        type_two_step(&function.0, t, h, x, evaluations)
    } else {
        type_three_step(function, t, h, x, evaluations)
    }
}

/// The stepper of a generating function of type II, its adjoint, or a symmetric composition of both. Its evaluations are
/// those of first or second derivatives of the function.
///
/// ```
/// use contact_geom::{ContactHamiltonian, PhasePoint, Scalar, nalgebra::SVector};
/// use discrete_herglotz::hamiltonian::{Arrangement, Euler, GeneratingStepper};
/// use discrete_herglotz::{SplittingScheme, Stepper};
/// /// Van der Pol's oscillator: H is linear in p, so that no Lagrangian exists.
/// struct VanDerPol;
/// impl ContactHamiltonian<1> for VanDerPol {
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
///         p[0] * z - q[0] + (q[0] * q[0] - 1.0) * z
///     }
/// }
/// let (start, composed) = (PhasePoint::new([2.0], [0.0], 0.5), Arrangement::Symmetric(SplittingScheme::KAHAN_LI_6));
/// let mut stepper = GeneratingStepper::new(Euler(VanDerPol), composed, 0.02, 0.0, start)?;
/// stepper.advance(100)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type GeneratingStepper<G, const N: usize> = MapStepper<GeneratingMaps<G>, N>;

/// The maps of generating functions in a step.
#[derive(Clone, Debug)]
pub struct GeneratingMaps<G> {
    function: Adjoint<G>,
    maps: Vec<PartialStep>,
}

impl<G: TypeTwo<N>, const N: usize> GeneratingStepper<G, N> {
    /// The stepper with steps of length h from the state at the time t0. The first step is taken once, as a check.
    ///
    /// # Errors
    /// [`InputError::Step`] unless h is finite and not 0; [`InputError::Geometry`] where the state is not finite;
    /// [`InputError::Hypothesis`] for a Runge-Kutta-Nyström scheme; [`InputError::Sigma`] and [`InputError::FirstStep`]
    /// where the first step fails.
    pub fn new(
        function: G,
        arrangement: Arrangement,
        h: f64,
        t0: f64,
        state: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let maps = GeneratingMaps { function: Adjoint(function), maps: arrangement.maps()? };
        let stepper = MapStepper::of(maps, h, t0, &state)?;
        let mut x = state;
        for map in &stepper.maps.maps {
            let change = partial_step(&stepper.maps.function, map, (t0, h), &x, &mut 0);
            x = change.map_err(InputError::first_step)?.after(&x);
        }
        Ok(stepper)
    }
}

impl<G: TypeTwo<N>, const N: usize> ContactMaps<N> for GeneratingMaps<G> {
    fn add_step(&self, t: f64, h: f64, sums: &mut StateSums<N>, evaluations: &mut u64) -> Result<(), StepError> {
        for map in &self.maps {
            sums.add(&partial_step(&self.function, map, (t, h), &sums.state(), evaluations)?);
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
