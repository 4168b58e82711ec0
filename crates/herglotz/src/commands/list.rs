//! `herglotz list`.

use crate::failure::Failure;
use crate::output::{print, print_json, table};
use clap::{Args, ValueEnum};
use herglotz::runtime::{AnyIntegrator, CATALOGUE, CatalogueEntry};

#[derive(Args)]
pub(crate) struct List {
    /// The kind of entries to list.
    #[arg(value_enum)]
    what: What,
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// The systems of the catalogue.
    Systems,
    /// The integrators.
    Integrators,
}

/// A short description of an integrator.
fn kind(integrator: AnyIntegrator) -> &'static str {
    match integrator {
        AnyIntegrator::Discrete(_) => "a discrete Lagrangian whose steps are solved by Newton's method",
        AnyIntegrator::Gauss { .. } => "contact Gauss collocation",
        AnyIntegrator::Divided(_) => "contact Gauss collocation, in steps that are divided where the motion is fast",
        AnyIntegrator::TransformedGauss { .. } => "contact Gauss collocation, in equal steps of transformed time",
        AnyIntegrator::Splitting(_) => "a splitting with the exact conformal factor, for v.Mv/2 - V(t, q) + f(z)",
        AnyIntegrator::Composition(..) => "a composition of a symmetric discrete Lagrangian",
        _ => "",
    }
}

impl List {
    pub fn run(&self) -> Result<(), Failure> {
        match self.what {
            What::Systems if self.json => {
                let of = |entry: &CatalogueEntry| {
                    let parameters: serde_json::Map<_, _> =
                        entry.parameters.iter().map(|(name, value)| ((*name).to_owned(), (*value).into())).collect();
                    serde_json::json!({
                        "name": entry.name, "about": entry.about, "coordinates": entry.coordinates,
                        "lagrangian": entry.lagrangian, "parameters": parameters, "q": entry.q, "v": entry.v,
                    })
                };
                print_json(&CATALOGUE.iter().map(of).collect())
            }
            What::Systems => {
                let of = |entry: &CatalogueEntry| {
                    vec![entry.name.into(), entry.about.into(), entry.lagrangian.replace('\n', "; ")]
                };
                print(&table(&CATALOGUE.iter().map(of).collect::<Vec<_>>()))
            }
            What::Integrators if self.json => {
                let of = |by: AnyIntegrator| serde_json::json!({ "name": by.to_string(), "order": by.order(), "about": kind(by) });
                print_json(&AnyIntegrator::all().into_iter().map(of).collect())
            }
            What::Integrators => {
                let of = |by: AnyIntegrator| vec![by.to_string(), format!("order {}", by.order()), kind(by).into()];
                print(&table(&AnyIntegrator::all().into_iter().map(of).collect::<Vec<_>>()))
            }
        }
    }
}
