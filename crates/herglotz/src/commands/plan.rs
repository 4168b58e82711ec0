//! `herglotz plan`.

use super::scene_arguments::{FormulaOrBody, SceneArguments};
use crate::failure::Failure;
use crate::output::{print, print_json};
use clap::Args;
use herglotz::runtime::{Body, FormulaSymmetry, RuntimeError};
use herglotz::{BodyScene, Scene};

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

/// The same for a rigid body.
fn proved_of_body(body: &Body) -> Vec<(&'static str, bool, &'static str)> {
    let is_free = body.mass == 0.0 || body.gravity == [0.0; 3];
    vec![
        ("autonomous", true, "L does not depend on t"),
        ("z_free", body.gamma == 0.0, "L does not depend on z: no dissipation"),
        ("z_affine", true, "L = L0(R, omega) + gamma z"),
        ("constant_rate", true, "L_z is constant"),
        ("free", is_free, "no torque acts"),
    ]
}

/// What is printed of a scene beside the plan of its motion.
struct Facts {
    /// What the properties are proved from.
    source: &'static str,
    /// The properties that can be proved, whether they are, and their meaning.
    proved: Vec<(&'static str, bool, &'static str)>,
    /// The momenta of symmetries.
    momenta: Vec<String>,
    /// The number of members of the sweep, and whether there is one.
    members: (usize, bool),
}

impl Plan {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = match self.scene.read_formula_or_body()? {
            FormulaOrBody::Formula(scene) => scene,
            FormulaOrBody::Body(scene) => return self.plan_body(&scene),
        };
        let plan = scene.system.plan(&scene.motion()).map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let facts = Facts {
            source: "the formula",
            proved: proved(&scene),
            momenta: scene.system.symmetries().iter().map(|symmetry| momentum(&scene, symmetry)).collect(),
            members: (scene.members().count(), !scene.swept.is_empty()),
        };
        self.print(&plan, &facts)
    }

    /// The plan of a scene of a rigid body.
    fn plan_body(&self, scene: &BodyScene) -> Result<(), Failure> {
        let explain = |error: RuntimeError| self.scene.explain(scene.explain(&error));
        let plan = scene.body.plan(&scene.motion).map_err(explain)?;
        let facts = Facts {
            source: "the body",
            proved: proved_of_body(&scene.body),
            momenta: scene.body.momenta().map_err(explain)?,
            members: (scene.combinations().count(), !scene.swept.is_empty()),
        };
        self.print(&plan, &facts)
    }

    fn print(&self, plan: &herglotz::runtime::Plan, facts: &Facts) -> Result<(), Failure> {
        let Facts { source, proved, momenta, members: (members, has_sweep) } = facts;
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
                "members": members,
            }));
        }
        let mut lines = vec![plan.text.trim_end().to_owned(), format!("proved from {source}:")];
        let holding = proved.iter().filter(|(_, holds, _)| *holds);
        lines.extend(holding.map(|(name, _, meaning)| format!("  {name}: {meaning}")));
        lines.extend(momenta.iter().map(|momentum| format!("  {momentum} decays as the conformal factor")));
        if *has_sweep {
            lines.push(format!("the sweep has {members} members"));
        }
        print(&lines.join("\n"))
    }
}
