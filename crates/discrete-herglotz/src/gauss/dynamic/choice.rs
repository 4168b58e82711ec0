//! The choice of the route of a motion.

use crate::InputError;
use crate::gauss::dynamic::initial_mass::InitialMass;
use crate::gauss::dynamic::routes::StageRoute;
use crate::gauss::dynamic::routes::general::{Extension, General};
use crate::gauss::dynamic::stages::mass_matrix::Mass;
use crate::gauss::dynamic::system::{CollocationSystem, PointDerivatives, PointRef};
use crate::gauss::limits::MAX_LINEAR_DIMENSION;
use crate::gauss::resolution::tail;
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
    let InitialMass { w, inverse } = InitialMass::of(system, start.t, PointRef { q: start.q, v: start.v, z: start.z })?;
    let _ = (wants_z, w);
    let mass = Mass::new(&start.structure, inverse);
    let at = PointRef { q: start.q, v: start.p, z: start.z };
    let extension = (Extension::new(start.t, 0.0), false);
    let general = General::new(extension, StageTable::new(s, h), mass, start.depends_on_action, at, start.v);
    Ok((Box::new(general), None, 0.0))
}
