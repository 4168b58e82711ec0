//! `herglotz plan`.

use super::scene_arguments::SceneArguments;
use crate::failure::Failure;
use crate::output::{print, print_json};
use clap::Args;
use herglotz::runtime::RuntimeError;
use herglotz::{AnyScene, BodyScene, LatticeScene, Property};

#[derive(Args)]
pub(crate) struct Plan {
    #[command(flatten)]
    scene: SceneArguments,
    /// Print the plan as JSON.
    #[arg(long)]
    json: bool,
}

/// What is printed of a scene beside the plan of its motion.
struct Facts {
    /// What the properties are proved from.
    source: &'static str,
    /// The properties that can be proved.
    properties: Vec<Property>,
    /// The momenta of symmetries.
    momenta: Vec<String>,
    /// The number of members of the sweep, and whether there is one.
    members: (usize, bool),
}

impl Plan {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = match self.scene.read_any()? {
            AnyScene::Motion(scene) => scene,
            AnyScene::Body(scene) => return self.plan_body(&scene),
            AnyScene::Lattice(scene) if !scene.is_a_formula() => return self.plan_lattice(&scene),
            // A lattice of few sites is a formula as well; a path is refused.
            AnyScene::Lattice(_) | AnyScene::Path(_) => Box::new(self.scene.read()?),
        };
        let plan = scene.system.plan(&scene.motion()).map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let facts = Facts {
            source: "the formula",
            properties: scene.properties(),
            momenta: scene.momenta(),
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
            properties: scene.properties(),
            momenta: scene.body.momenta().map_err(explain)?,
            members: (scene.combinations().count(), !scene.swept.is_empty()),
        };
        self.print(&plan, &facts)
    }

    /// The plan of a scene of a lattice with many sites.
    fn plan_lattice(&self, scene: &LatticeScene) -> Result<(), Failure> {
        let explain = |error: RuntimeError| self.scene.explain(scene.explain(&error));
        if !self.json {
            return print(scene.plan().map_err(explain)?.trim_end());
        }
        let (step_size, steps) = scene.motion.step().map_err(explain)?;
        let integrator = scene.motion.by.to_string();
        print_json(
            &serde_json::json!({ "integrator": integrator, "step_size": step_size, "steps": steps, "sites": scene.sizes }),
        )
    }

    fn print(&self, plan: &herglotz::runtime::Plan, facts: &Facts) -> Result<(), Failure> {
        let Facts { source, properties, momenta, members: (members, has_sweep) } = facts;
        if self.json {
            let of = |item: &herglotz::runtime::PlanEntry| serde_json::json!({ "what": item.what, "computed": item.computed, "why": item.why });
            let proved: serde_json::Map<_, _> =
                properties.iter().map(|property| (property.name.to_owned(), property.is_proved.into())).collect();
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
        let proved = properties.iter().filter(|property| property.is_proved);
        lines.extend(proved.map(|Property { name, meaning, .. }| format!("  {name}: {meaning}")));
        lines.extend(momenta.iter().map(|momentum| format!("  {momentum} decays as the conformal factor")));
        if *has_sweep {
            lines.push(format!("the sweep has {members} members"));
        }
        print(&lines.join("\n"))
    }
}
