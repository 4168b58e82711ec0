//! Lattices given by the formulas of a site and of a bond.

use super::system::SiteSystem;
use super::term::AtRest;
use crate::RuntimeError;
use crate::full::{FULL, not_compiled};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, VelocityPoint};
use formula_lagrangian::{Formula, FormulaLagrangian};
use sparse_herglotz::{FIXED, SparseSystem};
use std::str::FromStr;

pub(super) const NOT_AFFINE: &str =
    "depends on z in another form than `gamma*z` with a gamma that is a number or a function of t";

/// Boundary conditions of a lattice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Boundary {
    /// The ends are joined.
    #[default]
    Periodic,
    /// Walls: a site before the first and one after the last, held at 0.
    Fixed,
    /// No bonds beyond the ends.
    Free,
}

impl FromStr for Boundary {
    type Err = RuntimeError;
    fn from_str(name: &str) -> Result<Self, RuntimeError> {
        match name {
            "periodic" => Ok(Boundary::Periodic),
            "fixed" => Ok(Boundary::Fixed),
            "free" => Ok(Boundary::Free),
            _ => Err(RuntimeError::argument(
                "boundary",
                format!("is {name:?}; it must be \"periodic\", \"fixed\" or \"free\""),
            )),
        }
    }
}

/// A lattice of equal sites with a bond between neighbours along each direction, given by formulas: `L = sum_sites l(t,
/// x, x') + sum_bonds b(t, xl, xr) + gamma(t) z`.
///
/// The Lagrangian of a site is `x'^2 m/2 - V(t, x) + gamma(t) z`. Each site satisfies its own Herglotz equation, which
/// includes the forces of its bonds. The action z is that of the whole lattice, so the term `gamma(t) z` counts once.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    /// The names of the components at a site, 1 to 3 of them, such as `x`. In a bond, `xl` is the component at the site
    /// before, `xr` at the site after.
    pub coordinates: Vec<String>,
    /// The Lagrangian of a site.
    pub site: String,
    /// The Lagrangian of a bond, without velocities and z; `None` where sites do not interact.
    pub bond: Option<String>,
    /// The number of sites along each direction. Sites along the last direction are contiguous.
    pub sizes: Vec<usize>,
    /// The boundary condition, the same for each direction.
    pub boundary: Boundary,
    /// The parameters of the formulas, with their values.
    pub parameters: Vec<(String, f64)>,
}

impl Default for Lattice {
    /// An empty lattice in one coordinate `x`.
    fn default() -> Self {
        Lattice {
            coordinates: vec!["x".into()],
            site: String::new(),
            bond: None,
            sizes: Vec::new(),
            boundary: Boundary::default(),
            parameters: Vec::new(),
        }
    }
}

impl Lattice {
    /// The sparse system.
    ///
    /// # Errors
    /// [`RuntimeError::Part`] with the formula and the position in it; [`RuntimeError::Argument`] where a formula does
    /// not have the form of a site or a bond, for a parameter that neither formula uses, and for invalid sizes.
    pub fn system(&self) -> Result<SiteSystem, RuntimeError> {
        match self.coordinates.len() {
            1 => self.of::<1, 2>(),
            2 if const { FULL } => self.of::<2, 4>(),
            3 if const { FULL } => self.of::<3, 6>(),
            2 | 3 => Err(not_compiled("lattices with several coordinates at a site")),
            found => Err(RuntimeError::argument("coordinates", format!("has {found} names; it must have 1 to 3"))),
        }
    }

    /// The number of sites, validated.
    pub(super) fn sites(&self) -> Result<usize, RuntimeError> {
        let least = if self.boundary == Boundary::Periodic && self.bond.is_some() { 2 } else { 1 };
        if let Some(size) = self.sizes.iter().find(|size| **size < least) {
            return Err(RuntimeError::argument(
                "sites",
                format!("has {size} along a direction; at least {least} are required"),
            ));
        }
        match self.sizes.iter().try_fold(1usize, |product, size| product.checked_mul(*size)) {
            Some(sites) if !self.sizes.is_empty() => Ok(sites),
            Some(_) => Err(RuntimeError::argument("sites", "has no direction; at least one is required")),
            None => Err(RuntimeError::argument("sites", "exceeds the largest possible number of sites")),
        }
    }

    /// The formulas of a site and of a bond, validated as far as all lattices need it.
    pub(super) fn parts(&self) -> Result<(Formula, Option<Formula>), RuntimeError> {
        let names: Vec<&str> = self.coordinates.iter().map(String::as_str).collect();
        let of_bond = ["l", "r"].map(|side| names.iter().map(move |name| format!("{name}{side}")));
        let of_bond: Vec<String> = of_bond.into_iter().flatten().collect();
        let of_bond: Vec<&str> = of_bond.iter().map(String::as_str).collect();
        let site = self.parse("site", &self.site, &names)?;
        let bond = self.bond.as_ref().map(|text| self.parse("bond", text, &of_bond)).transpose()?;
        for (part, formula) in [("site", Some(&site)), ("bond", bond.as_ref())] {
            if formula.is_some_and(Formula::has_forces) {
                return Err(RuntimeError::argument(
                    part,
                    "has a force; give the forces of a lattice to the formula of the whole lattice",
                ));
            }
        }
        if let Some(bond) = &bond
            && !bond.derivatives()?.proved().z_free
        {
            return Err(RuntimeError::argument(
                "bond",
                "depends on z; write the drag `gamma*z` in `site`, where it counts once for the lattice",
            ));
        }
        Ok((site, bond))
    }

    /// Refuses parameters that neither formula uses: most are misspelt.
    ///
    /// # Errors
    /// [`RuntimeError::Argument`] with the name; [`RuntimeError::Part`] for a formula that is not valid.
    pub fn check_parameters(&self) -> Result<(), RuntimeError> {
        let (site, bond) = self.parts()?;
        for (name, _) in &self.parameters {
            let mut used = [Some(&site), bond.as_ref()].into_iter().flatten().flat_map(Formula::used_parameters);
            if !used.any(|known| known == name) {
                let where_to =
                    if bond.is_some() { "used neither in `site` nor in `bond`" } else { "not used in `site`" };
                return Err(RuntimeError::argument("parameters", format!("has `{name}`, which is {where_to}")));
            }
        }
        Ok(())
    }

    fn of<const D: usize, const K: usize>(&self) -> Result<SiteSystem, RuntimeError> {
        let sites = self.sites()?;
        self.check_parameters()?;
        let (site, bond) = self.parts()?;
        let site = lagrangian::<D>("site", &site)?;
        let bond = bond.map(|bond| lagrangian::<K>("bond", &bond)).transpose()?;
        let (masses, system) = (masses(&site)?, SparseSystem::new(sites * D)?);
        let each: Vec<f64> = masses.iter().flat_map(|m| std::iter::repeat_n(*m, sites)).collect();
        let system = if masses.iter().all(|m| *m == masses[0]) {
            system.with_mass(masses[0])
        } else {
            system.with_masses(each.clone())
        };
        let system = if site.proved().has_constant_rate() {
            system.with_drag(rate(&site, 0.0))
        } else {
            let timed = site.clone();
            system.with_timed_drag(move |t| rate(&timed, t))
        };
        // Component by component, so that the components of neighbours are contiguous in memory.
        let indices = (0..sites).map(|i| -> [usize; D] { std::array::from_fn(|c| c * sites + i) });
        let mut system = system.with_potential(AtRest(site), indices)?;
        if let Some(bond) = bond {
            check_bond(&bond)?;
            for along in 0..self.sizes.len() {
                let ends = self.bonds(along, sites).into_iter().map(|ends| -> [usize; K] {
                    let index_of = |c: usize, i: usize| if i == FIXED { FIXED } else { c * sites + i };
                    std::array::from_fn(|k| index_of(k % D, ends[usize::from(k >= D)]))
                });
                system = system.with_potential(AtRest(bond.clone()), ends)?;
            }
        }
        Ok(SiteSystem { system, sites, components: D, masses: each, full: false })
    }

    fn parse(&self, part: &'static str, text: &str, names: &[&str]) -> Result<Formula, RuntimeError> {
        let values: Vec<(&str, f64)> = self.parameters.iter().map(|(name, x)| (name.as_str(), *x)).collect();
        Formula::parse(text, names, &values).map_err(|error| RuntimeError::Part { part, error: Box::new(error) })
    }

    /// The ends of the bonds along a direction, row by row.
    fn bonds(&self, along: usize, sites: usize) -> Vec<[usize; 2]> {
        let size = self.sizes.get(along).copied().unwrap_or(1);
        let stride: usize = self.sizes.iter().skip(along + 1).product();
        let index_of = |i: usize| i / stride % size;
        let walls = (0..sites).filter(|i| self.boundary == Boundary::Fixed && index_of(*i) == 0).map(|i| [FIXED, i]);
        let inner = (0..sites).filter_map(|i| match self.boundary {
            _ if index_of(i) + 1 < size => Some([i, i + stride]),
            Boundary::Periodic => Some([i, i + stride - size * stride]),
            Boundary::Fixed => Some([i, FIXED]),
            Boundary::Free => None,
        });
        walls.chain(inner).collect()
    }
}

fn lagrangian<const N: usize>(part: &'static str, formula: &Formula) -> Result<FormulaLagrangian<N>, RuntimeError> {
    formula.lagrangian::<N>().map_err(|error| RuntimeError::Part { part, error: Box::new(error) })
}

/// The origin, where quantities that do not depend on the state are evaluated.
fn origin<const N: usize>() -> VelocityPoint<N> {
    VelocityPoint { q: SVector::zeros(), v: SVector::zeros(), z: 0.0 }
}

/// The rate `L_z` of a site.
fn rate<const N: usize>(site: &FormulaLagrangian<N>, t: f64) -> f64 {
    site.closed_gradient(t, &origin()).map_or(f64::NAN, |gradient| gradient.z)
}

/// The masses of a site's components.
fn masses<const N: usize>(site: &FormulaLagrangian<N>) -> Result<[f64; N], RuntimeError> {
    let proved = site.proved();
    if !proved.is_affine_in_z() {
        return Err(RuntimeError::argument("site", NOT_AFFINE));
    }
    let matrix = site.closed_mass_matrix(0.0, &origin()).filter(|_| proved.separable);
    let diagonal = matrix.filter(|m| (0..N * N).all(|k| k % N == k / N || m[(k % N, k / N)] == 0.0));
    let Some(m) = diagonal else {
        let what = "is not of the form m*x'^2/2 - V(t, x) + gamma*z with a constant mass m for each coordinate";
        return Err(RuntimeError::argument("site", what));
    };
    let masses = std::array::from_fn(|i| m[(i, i)]);
    match masses.iter().find(|m| !(**m > 0.0 && m.is_finite())) {
        Some(m) => Err(RuntimeError::argument(
            "site",
            format!("has the mass {m}; each coordinate needs a positive mass m, as in m*x'^2/2"),
        )),
        None => Ok(masses),
    }
}

/// Rejects a bond with velocities.
fn check_bond<const N: usize>(bond: &FormulaLagrangian<N>) -> Result<(), RuntimeError> {
    let masses = bond.closed_mass_matrix(0.0, &origin()).filter(|_| bond.proved().separable);
    if masses.is_none_or(|m| m.iter().any(|m| *m != 0.0)) {
        return Err(RuntimeError::argument(
            "bond",
            "depends on velocities; a bond must be minus the potential energy of its two ends",
        ));
    }
    Ok(())
}
