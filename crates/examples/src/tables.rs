//! Checks that the tables of the guide agree with those that the code generates.

use crate::systems::{Pendulum, System, SystemVisitor, catalogue_size, visit_catalogue};
use discrete_herglotz::{AnyIntegrator, Integrator, MethodInfo};

/// The table of the integrators, with one line for each kind: names, orders, whether a step is explicit or implicit,
/// `sigma_d` for a linear drag, and the number of systems of the catalogue that meet the hypotheses.
fn integrators() -> String {
    let mut kinds: Vec<(MethodInfo, Vec<AnyIntegrator>)> = Vec::new();
    for integrator in AnyIntegrator::all() {
        let info = info(&integrator);
        let same = |other: &MethodInfo| {
            let of = |f: &MethodInfo| {
                (f.explicit, f.symmetric, f.exact_rate, f.in_transformed_time, f.substeps, f.collocation.is_some())
            };
            let of_any_order = info.collocation.is_some() || info.substeps && !info.explicit;
            of(other) == of(&info) && (of_any_order || other.order == info.order)
        };
        match kinds.iter_mut().find(|(of_kind, _)| same(of_kind)) {
            Some((_, kind)) => kind.push(integrator),
            None => kinds.push((info, vec![integrator])),
        }
    }
    let mut table = format!(
        "| Name | Order | Step | `sigma_d` of a linear drag | Takes, of {} systems |\n|---|---|---|---|---|\n",
        catalogue_size()
    );
    for (info, kind) in &kinds {
        let names: Vec<String> = kind.iter().map(|integrator| format!("`{integrator}`")).collect();
        let last = kind.last().map_or(0, |integrator| integrator.order());
        let names = match (info.collocation, names.as_slice()) {
            (Some(_), [first, .., last_name]) => format!("{first} .. {last_name}"),
            _ => names.join(", "),
        };
        let order = if last == info.order { last.to_string() } else { format!("{} .. {last}", info.order) };
        let step = if info.explicit { "explicit" } else { "implicit" };
        let rate = if info.exact_rate { "`e^(gamma h)`" } else { "to the order" };
        let taken = kind.first().map_or(0, taken);
        table += &format!("| {names} | {order} | {step} | {rate} | {taken} |\n");
    }
    table
}

/// The systems of the catalogue, with the numbers of their coordinates.
fn systems() -> String {
    struct Names(Vec<String>);
    impl SystemVisitor for Names {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            self.0.push(format!("`{}` ({N})", system.name()));
        }
    }
    let mut names = Names(Vec::new());
    visit_catalogue(&mut names);
    names.0.join(", ") + "\n"
}

fn info(integrator: &AnyIntegrator) -> MethodInfo {
    Integrator::<'_, Pendulum, 1>::info(integrator)
}

/// The number of systems of the catalogue that meet the hypotheses of an integrator.
fn taken(integrator: &AnyIntegrator) -> usize {
    struct Taken(AnyIntegrator, usize);
    impl SystemVisitor for Taken {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            self.1 += usize::from(self.0.check(system).is_ok());
        }
    }
    let mut taken = Taken(*integrator, 0);
    visit_catalogue(&mut taken);
    taken.1
}

/// The text of the guide between `<!-- name -->` and `<!-- end name -->`.
fn part(name: &str) -> &'static str {
    let guide = include_str!("../../../docs/guide.md");
    let (_, rest) = guide.split_once(&format!("<!-- {name} -->\n")).unwrap_or_default();
    rest.split_once(&format!("<!-- end {name} -->")).unwrap_or_default().0
}

#[test]
fn the_guide_has_the_tables_of_the_code() {
    for (name, table) in [("integrators", integrators()), ("systems", systems())] {
        assert!(part(name) == table, "docs/guide.md must contain, between the comments <!-- {name} -->:\n{table}");
    }
}
