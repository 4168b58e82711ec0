//! The choice of the route of a motion.

use crate::InputError;
use crate::gauss::initial_mass::InitialMass;
use crate::gauss::limits::MAX_LINEAR_DIMENSION;
use crate::gauss::resolution::tail::of_sigma;
use crate::gauss::routes::StageRoute;
use crate::gauss::routes::general::{Extension, General};
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::linear::Linear;
use crate::gauss::routes::separable::Separable;
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::system::{CollocationSystem, PointGradient, PointRef};
use crate::gauss::tables::condensed::Condensed;
use crate::gauss::tables::stage_table::StageTable;
use contact_geom::Structure;
use contact_geom::nalgebra::DMatrix;

/// The start of a motion, and what is known of its Lagrangian.
pub(crate) struct Start<'r> {
    pub t: f64,
    pub q: &'r [f64],
    pub v: &'r [f64],
    pub p: &'r [f64],
    pub z: f64,
    pub structure: Structure,
    /// Whether L is given by a contact Hamiltonian.
    pub is_hamiltonian: bool,
    pub is_separable: bool,
    /// Whether the mass matrix is inverted at one stage after another, whatever the number of coordinates.
    pub by_points: bool,
    /// Whether the motion depends on the action.
    pub depends_on_action: bool,
}

/// A route, the mass matrix of a condensed one, and the defect of its conformal factor.
pub(crate) type ChosenRoute = (Box<dyn StageRoute>, Option<DMatrix<f64>>, f64);

/// The least expensive route that the structure of L allows.
///
/// # Errors
/// [`InputError::FirstStep`] if the mass matrix at the start is singular; [`InputError::Sigma`] and
/// [`InputError::Step`] if the step is too long for a constant rate.
pub(crate) fn route_of(
    system: &dyn CollocationSystem,
    start: &Start<'_>,
    s: usize,
    h: f64,
    wants_z: bool,
) -> Result<ChosenRoute, InputError> {
    let (structure, state) = (&start.structure, PointRef { q: start.q, v: start.p, z: start.z });
    if start.is_hamiltonian {
        return Ok((Box::new(HamiltonianStages::new(system, StageTable::new(s, h), state, start.v)), None, 0.0));
    }
    let at = PointRef { v: start.v, ..state };
    let InitialMass { w, inverse } = InitialMass::of(system, start.t, at)?;
    if !(start.is_separable && structure.has_constant_rate()) {
        let (extension, mass) = ((Extension::new(start.t, 0.0), false), Mass::new(structure, inverse, start.by_points));
        let general = General::new(extension, StageTable::new(s, h), mass, start.depends_on_action, state, start.v);
        return Ok((Box::new(general), None, 0.0));
    }
    let mut gradient = PointGradient::zeros(start.q.len());
    system.gradient(start.t, at, &mut gradient);
    let table = Condensed::of(s, h, gradient.z)?;
    let of_sigma = of_sigma(1.0 + table.grow.head, table.gamma * h);
    let is_linear = structure.quadratic && structure.autonomous && start.q.len() <= MAX_LINEAR_DIMENSION;
    if is_linear && let Some(linear) = Linear::new(system, &table, &inverse, start.t, at, wants_z) {
        return Ok((Box::new(linear), Some(w), of_sigma));
    }
    let left = table.preconditioned(0.0).ok_or(InputError::Step { h })?;
    let inverse = (!w.is_identity(0.0)).then_some(inverse);
    Ok((Box::new(Separable::new(table, left, inverse, at, wants_z)), Some(w), of_sigma))
}
