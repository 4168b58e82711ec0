//! `herglotz plan`.

use super::scene_arguments::SceneArguments;
use crate::failure::Failure;
use crate::output::{print, print_json};
use clap::Args;
use herglotz::Scene;
use herglotz::runtime::FormulaSymmetry;

#[derive(Args)]
pub(crate) struct Plan {
    #[command(flatten)]
    scene: SceneArguments,
    /// Print the plan as JSON.
    #[arg(long)]
    json: bool,
}

/// The momentum of a symmetry, as a formula.
pub(crate) fn momentum(scene: &Scene, symmetry: &FormulaSymmetry) -> String {
    let names = scene.system.formula().coordinates();
    let name = |i: usize| names.get(i).map(String::as_str).unwrap_or_default();
    let all: Vec<_> = match symmetry {
        FormulaSymmetry::Translation(moved) => {
            let momenta = scene.system.formula().momenta();
            moved.iter().filter_map(|i| momenta.get(*i).cloned()).collect()
        }
        FormulaSymmetry::Rotation(pairs) => {
            pairs.iter().map(|(i, j)| format!("{x}*p_{y} - {y}*p_{x}", x = name(*i), y = name(*j))).collect()
        }
    };
    all.join(" + ")
}

/// The properties of a system that can be proved, whether they are, and their meaning.
fn proved(scene: &Scene) -> Vec<(&'static str, bool, &'static str)> {
    if let Some(structure) = scene.system.hamiltonian_structure() {
        return vec![
            ("smooth", scene.system.is_smooth(), "H has neither kinks nor jumps"),
            ("autonomous", structure.autonomous, "H does not depend on t"),
            ("z_free", structure.z_free, "H does not depend on z: no dissipation"),
            ("z_affine", structure.z_affine, "H = H0(t, q, p) - gamma(t) z"),
            ("constant_rate", structure.constant_rate, "H_z is constant"),
            ("separable", structure.separable, "H = T(p) + V(t, q) + f(t, z)"),
            ("polynomial", structure.degree.is_some(), "H is a polynomial in the momenta"),
            ("homogeneous", structure.homogeneous, "p . H_p = H: H is homogeneous of degree one in the momenta"),
        ];
    }
    let structure = scene.system.structure();
    vec![
        ("smooth", scene.system.is_smooth(), "L has neither kinks nor jumps"),
        ("autonomous", structure.autonomous, "L does not depend on t"),
        ("z_free", structure.z_free, "L does not depend on z: no dissipation"),
        ("z_affine", structure.z_affine, "L = L0(t, q, v) + gamma(t) z"),
        ("constant_rate", structure.has_constant_rate(), "L_z is constant"),
        ("separable", structure.separable, "L = v.Mv/2 - V(t, q) + f(t, z), M constant"),
        ("quadratic", structure.quadratic, "the equation of motion is linear"),
        ("constant_mass", structure.constant_mass, "W = L_vv is constant"),
    ]
}

impl Plan {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = self.scene.read()?;
        let plan = scene.system.plan(&scene.motion()).map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let proved = proved(&scene);
        let momenta: Vec<String> =
            scene.system.symmetries().iter().map(|symmetry| momentum(&scene, symmetry)).collect();
        if self.json {
            let of = |item: &herglotz::runtime::PlanEntry| serde_json::json!({ "what": item.what, "computed": item.computed, "why": item.why });
            let proved: serde_json::Map<_, _> =
                proved.iter().map(|(name, holds, _)| ((*name).to_owned(), (*holds).into())).collect();
            return print_json(&serde_json::json!({
                "integrator": plan.integrator.name,
                "order": plan.integrator.order,
                "source": plan.integrator.source,
                "step_size": plan.step_size,
                "steps": plan.steps,
                "estimated_error": plan.error,
                "items": plan.items.iter().map(of).collect::<Vec<_>>(),
                "proved": proved,
                "momenta": momenta,
                "members": scene.members().count(),
            }));
        }
        let mut lines = vec![plan.text.trim_end().to_owned(), "proved from the formula:".to_owned()];
        let holding = proved.iter().filter(|(_, holds, _)| *holds);
        lines.extend(holding.map(|(name, _, meaning)| format!("  {name}: {meaning}")));
        lines.extend(momenta.iter().map(|momentum| format!("  {momentum} decays as the conformal factor")));
        if !scene.swept.is_empty() {
            lines.push(format!("the sweep has {} members", scene.members().count()));
        }
        print(&lines.join("\n"))
    }
}
