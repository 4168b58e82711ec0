//! Systems of many coordinates in the table `[system]`: lattices and bodies as formulas.

use super::SceneError;
use super::file::SystemTable;
use super::location::{Location, Span};
use crate::runtime::{Bodies, Boundary, FormulaError, Lattice, RuntimeError, SumOfTerms};
use schemars::JsonSchema;
use serde::Deserialize;

/// A lattice of equal sites with bonds between neighbours, whose components are the coordinates of the system.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `sites`, `site` and `bond`")]
pub(crate) struct LatticeTerms {
    /// The number of sites, or a list with the number along each direction.
    pub sites: Location<Sizes>,
    /// The boundary condition along each direction: periodic, fixed walls at 0, or free ends.
    #[serde(default)]
    pub boundary: BoundaryName,
    /// The Lagrangian of a site, affine in z. The term in z is that of the whole lattice, and counts once.
    pub site: Location<String>,
    /// The Lagrangian of a bond, in the coordinates `xl` of the site before it and `xr` of the site after it.
    pub bond: Option<Location<String>>,
}

/// The number of sites.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a whole number, or a list of them")]
#[schemars(inline)]
pub(crate) enum Sizes {
    /// In a chain.
    One(usize),
    /// Along each direction.
    Many(Vec<usize>),
}

impl Sizes {
    /// The number along each direction.
    pub fn to_vec(&self) -> Vec<usize> {
        match self {
            Sizes::One(sites) => vec![*sites],
            Sizes::Many(sizes) => sizes.clone(),
        }
    }
}

/// The boundary condition of a lattice.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum BoundaryName {
    /// The ends are joined.
    #[default]
    Periodic,
    /// Walls at 0.
    Fixed,
    /// No bonds beyond the ends.
    Free,
}

impl From<BoundaryName> for Boundary {
    fn from(name: BoundaryName) -> Self {
        match name {
            BoundaryName::Periodic => Boundary::Periodic,
            BoundaryName::Fixed => Boundary::Fixed,
            BoundaryName::Free => Boundary::Free,
        }
    }
}

/// Bodies with Newtonian gravitation of each pair. The parameters `G`, by default 1, and `gamma`, the rate of the drag, by
/// default 0, are those of the system, as the masses `m_0`, `m_1`, ... are; the coordinates are `x_0`, `y_0`, ...
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `masses` and `dimensions`")]
pub(crate) struct BodiesTerms {
    /// The mass of each body.
    pub masses: Location<Vec<f64>>,
    /// The dimension of space: 2 or 3.
    pub dimensions: usize,
}

/// The formula of the lattice or the bodies of a system, if it is one.
pub(super) fn read(text: &str, system: &Location<SystemTable>) -> Result<Option<SumOfTerms>, SceneError> {
    if let (Some(lattice), Some(table)) = (lattice(system), &system.lattice) {
        let spans = spans_of_lattice(system, table);
        return lattice.sum_of_terms().map(Some).map_err(|error| explain(text, &spans, table.span(), &error));
    }
    system.bodies.as_ref().map(|bodies| of_bodies(text, system, bodies)).transpose()
}

/// The lattice of a system, if it is one.
pub(super) fn lattice(system: &SystemTable) -> Option<Lattice> {
    let table = system.lattice.as_ref()?;
    let coordinates = match &system.coordinates {
        Some(names) => names.iter().map(|name| (**name).clone()).collect(),
        None => vec!["x".to_owned()],
    };
    Some(Lattice {
        coordinates,
        site: (*table.site).clone(),
        bond: table.bond.as_ref().map(|bond| (**bond).clone()),
        sizes: table.sites.to_vec(),
        boundary: table.boundary.into(),
        // Those that events alone use belong to no site.
        parameters: system.parameters.0.iter().map(|(name, value)| ((**name).clone(), **value)).collect(),
    })
}

/// The positions of what makes a lattice.
pub(super) fn spans_of_lattice(
    system: &Location<SystemTable>,
    table: &Location<LatticeTerms>,
) -> [(&'static str, Span); 5] {
    let of_parameters = system.parameters.0.first().map_or(table.span(), |(name, _)| name.span());
    [
        ("site", table.site.span()),
        ("bond", table.bond.as_ref().map_or(table.span(), Location::span)),
        ("sites", table.sites.span()),
        ("coordinates", system.coordinates.as_ref().map_or(table.span(), Location::span)),
        ("parameters", of_parameters),
    ]
}

fn of_bodies(
    text: &str,
    system: &Location<SystemTable>,
    table: &Location<BodiesTerms>,
) -> Result<SumOfTerms, SceneError> {
    if let Some(coordinates) = &system.coordinates {
        let message = "the coordinates of bodies are `x_0`, `y_0` and so on; remove `coordinates`";
        return Err(SceneError::at(text, coordinates.span(), message));
    }
    let given = |name: &str, default: f64| system.parameters.get(name).map_or(default, |value| **value);
    let of = |(i, m): (usize, &f64)| given(&format!("m_{i}"), *m);
    let masses = table.masses.iter().enumerate().map(of).collect();
    let bodies = Bodies { masses, dimensions: table.dimensions, g: given("G", 1.0), gamma: given("gamma", 0.0) };
    let spans = [("masses", table.masses.span())];
    let mut terms = bodies.sum_of_terms().map_err(|error| explain(text, &spans, table.span(), &error))?;
    for (name, value) in &system.parameters.0 {
        if !terms.parameters.iter().any(|(known, _)| *known == **name) {
            terms.parameters.push(((**name).clone(), **value));
        }
    }
    Ok(terms)
}

/// The error with the position of the argument that it names.
pub(super) fn explain(text: &str, spans: &[(&'static str, Span)], otherwise: Span, error: &RuntimeError) -> SceneError {
    let place = |name: &str| spans.iter().find(|(known, _)| *known == name).map_or(otherwise, |(_, span)| *span);
    match error {
        RuntimeError::Part { part, error } => match &**error {
            FormulaError::Parse(error) => {
                let mut error = error.clone();
                if error.message.starts_with("unknown name") && error.nearest.is_none() {
                    error.message += "; a parameter needs a value in `parameters` of [system]";
                }
                SceneError::in_string(text, place(part), &error)
            }
            error => SceneError::at(text, place(part), error.to_string()),
        },
        RuntimeError::Argument { argument, .. } => SceneError::at(text, place(argument), error.to_string()),
        error => SceneError::at(text, otherwise, error.to_string()),
    }
}
