//! The system of a scene.

use super::SceneError;
use super::checked::finite;
use super::file::SystemTable;
use super::location::Location;
use super::sum_of_terms;
use crate::runtime::{CatalogueEntry, Formula, FormulaError, FormulaNames, RuntimeError, Table, check_parameters};

/// The entry of the catalogue that a scene names.
pub(super) fn entry(text: &str, system: &Location<SystemTable>) -> Result<Option<&'static CatalogueEntry>, SceneError> {
    let refuse = |span, message: &str| Err(SceneError::at(text, span, message));
    if let (Some(_), Some(hamiltonian)) = (&system.lagrangian, &system.hamiltonian) {
        return refuse(hamiltonian.span(), "give a `lagrangian` or a `hamiltonian`, not both");
    }
    if let (None, Some(momenta)) = (&system.hamiltonian, &system.momenta) {
        return refuse(momenta.span(), "`momenta` are names for a `hamiltonian`; remove them, or give one");
    }
    if let (Some(_), Some(action)) = (&system.catalogue, &system.action) {
        return refuse(action.span(), "the action of a system of the catalogue is `z`; remove `action`");
    }
    if system.lattice.is_some() || system.bodies.is_some() {
        let own = system.lagrangian.as_ref().or(system.hamiltonian.as_ref()).or(system.catalogue.as_ref());
        return match (own, &system.lattice, &system.bodies, &system.action) {
            (Some(own), ..) => refuse(own.span(), "give this or a `lattice` or `bodies`, not both"),
            (None, Some(_), Some(bodies), _) => refuse(bodies.span(), "give a `lattice` or `bodies`, not both"),
            (None, _, _, Some(action)) => {
                refuse(action.span(), "the action of a lattice and of bodies is `z`; remove `action`")
            }
            (None, ..) => Ok(None),
        };
    }
    match (&system.catalogue, &system.coordinates, system.lagrangian.as_ref().or(system.hamiltonian.as_ref())) {
        (Some(name), None, None) => match CatalogueEntry::find(name) {
            Ok(entry) => Ok(Some(entry)),
            Err(error) => Err(SceneError::at(text, name.span(), error.to_string())),
        },
        (Some(name), ..) => refuse(name.span(), "give a `catalogue` or a `lagrangian` with `coordinates`, not both"),
        (None, Some(_), Some(_)) => Ok(None),
        (None, Some(_), None) => refuse(system.span(), "the system has no `lagrangian`; add it as a string in quotes"),
        (None, None, Some(_)) => {
            refuse(system.span(), "the system has no `coordinates`; add their names, as in coordinates = [\"x\"]")
        }
        (None, None, None) => refuse(
            system.span(),
            "the system has neither a `lagrangian` with `coordinates` nor a `catalogue`; add one of them",
        ),
    }
}

/// The formula of a scene.
pub(super) fn formula(
    text: &str,
    system: &Location<SystemTable>,
    entry: Option<&'static CatalogueEntry>,
    tables: &[(Location<String>, Table)],
) -> Result<Formula, SceneError> {
    for (name, value) in &system.parameters.0 {
        finite(text, value, name)?;
    }
    let of_tables = || tables.iter().map(|(name, _)| name);
    let at_system = |error: FormulaError| SceneError::at(text, system.span(), error.to_string());
    if let Some(terms) = sum_of_terms::read(text, system)? {
        let coordinates: Vec<&str> = terms.coordinates.iter().map(String::as_str).collect();
        let parameters: Vec<(&str, f64)> = terms.parameters.iter().map(|(name, x)| (name.as_str(), *x)).collect();
        let tables: Vec<(&str, Table)> = tables.iter().map(|(name, table)| (name.as_str(), table.clone())).collect();
        let names = FormulaNames { tables: &tables, ..FormulaNames::new(&coordinates, &parameters) };
        return Formula::parse_lagrangian(&terms.lagrangian, &names).map_err(at_system);
    }
    let Some(entry) = entry else {
        let source = system.lagrangian.as_ref().or(system.hamiltonian.as_ref());
        let (Some(coordinates), Some(source)) = (&system.coordinates, source) else {
            return Err(SceneError::at(text, system.span(), "the system has no formula"));
        };
        let names: Vec<&str> = coordinates.iter().map(|name| name.as_str()).collect();
        let values: Vec<(&str, f64)> =
            system.parameters.0.iter().map(|(name, value)| (name.as_str(), **value)).collect();
        let tables: Vec<(&str, Table)> = tables.iter().map(|(name, table)| (name.as_str(), table.clone())).collect();
        let of_momenta = || system.momenta.iter().flat_map(|momenta| momenta.iter());
        let momenta: Vec<&str> = of_momenta().map(|name| name.as_str()).collect();
        let names = FormulaNames {
            tables: &tables,
            momenta: &momenta,
            action: system.action.as_ref().map_or("z", |name| name.as_str()),
            ..FormulaNames::new(&names, &values)
        };
        let parsed = match &system.hamiltonian {
            Some(_) if momenta.is_empty() && system.momenta.is_some() => {
                Err(FormulaError::Momenta { found: 0, expected: coordinates.len() })
            }
            Some(_) => Formula::parse_hamiltonian(source, &names),
            None => Formula::parse_lagrangian(source, &names),
        };
        return parsed.map_err(|error| match error {
            FormulaError::Parse(mut error) => {
                if error.message.starts_with("unknown name") && error.nearest.is_none() {
                    error.message += "; a parameter needs a value in `parameters` of [system]";
                }
                SceneError::in_string(text, source.span(), &error)
            }
            FormulaError::Name { ref name, .. } => {
                let of_parameters = system.parameters.0.iter().map(|(key, _)| key);
                let of_system = system.action.iter().chain(coordinates.iter()).chain(of_momenta());
                let mut known = of_system.chain(of_parameters).chain(of_tables());
                let at = known.rfind(|known| ***known == *name).map(Location::span);
                SceneError::at(text, at.unwrap_or(coordinates.span()), error.to_string())
            }
            FormulaError::Momenta { .. } => {
                let at = system.momenta.as_ref().map_or(coordinates.span(), Location::span);
                SceneError::at(text, at, error.to_string())
            }
            FormulaError::Dimension { .. } => SceneError::at(text, coordinates.span(), error.to_string()),
            error => at_system(error),
        });
    };
    let mut formula = entry.formula().map_err(|error| SceneError::at(text, system.span(), error.to_string()))?;
    for (name, table) in tables {
        let refused = |error: FormulaError| SceneError::at(text, name.span(), error.to_string());
        formula = formula.with_table(name, table).map_err(refused)?;
    }
    for (name, value) in &system.parameters.0 {
        let known = || entry.parameters.iter().map(|(parameter, _)| *parameter);
        if let Err(error) = formula.set(name, **value) {
            return Err(SceneError::unknown(text, name.span(), name, known(), error.to_string()));
        }
    }
    Ok(formula)
}

/// Rejects parameters that occur neither in the formula nor in the texts of columns and events.
pub(super) fn check_used(
    text: &str,
    formula: &Formula,
    system: &Location<SystemTable>,
    texts: &[&str],
) -> Result<(), SceneError> {
    check_parameters(formula, texts).map_err(|error| {
        let named = |name: &str| system.parameters.0.iter().find(|(known, _)| **known == *name);
        let span = match &error {
            RuntimeError::UnusedParameter { name, .. } => named(name).map(|(name, _)| name.span()),
            _ => None,
        };
        SceneError::at(text, span.unwrap_or(system.span()), error.to_string())
    })
}
