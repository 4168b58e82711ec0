//! A random system with two features, as a formula of the library.

use super::feature::Feature;
use super::random::Random;
use herglotz_runtime::{
    AnyIntegrator, Event, Formula, FormulaDirection, FormulaNames, FormulaReset, Impact, InitialVelocity, Motion,
    Start, StepControl, Steps, System,
};

/// How the library is given a system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    Lagrangian,
    Hamiltonian,
    /// The pendulum at `(x, y) = (sin theta, -cos theta)`, with the constraint that its length is 1. The coordinate of the
    /// reference is theta.
    Constrained,
}

/// `L = m x'^2/2 - V(x) + gamma z` with `V = k x^2/2` or `k (1 - cos x)`, and two features.
#[derive(Clone, Debug)]
pub struct Problem {
    pub m: f64,
    pub k: f64,
    pub gamma: f64,
    pub pendulum: bool,
    pub form: Form,
    pub features: Vec<Feature>,
    /// Position, velocity and action at the time 0.
    pub start: [f64; 3],
    pub end: f64,
    pub step_control: StepControl,
}

impl Problem {
    pub fn draw(random: &mut Random) -> Self {
        let form = match random.below(10) {
            0..2 => Form::Hamiltonian,
            2 => Form::Constrained,
            _ => Form::Lagrangian,
        };
        let (x, v) = (random.between(-1.0, 1.0), random.sign() * random.between(0.2, 1.5));
        let end = random.between(1.0, 6.0);
        let mut features: Vec<Feature> = Vec::new();
        while features.len() < 2 {
            let feature = Feature::draw(random, x, end, form, &features);
            if !features.iter().any(|other| other.excludes(&feature)) {
                features.push(feature);
            }
        }
        let step_control = match random.below(4) {
            0 | 1 => StepControl::Accuracy { error: 1e-9, by: None },
            2 if form != Form::Constrained => StepControl::Steps {
                by: AnyIntegrator::Gauss { stages: 8 },
                steps: Steps::Size(random.between(0.05, 0.3)),
            },
            _ => StepControl::Steps {
                by: AnyIntegrator::Gauss { stages: 6 },
                steps: Steps::Count(20 + random.below(40)),
            },
        };
        Problem {
            m: random.between(0.5, 2.0),
            k: random.between(0.3, 4.0),
            gamma: if random.chance(0.3) { 0.0 } else { random.between(-0.5, 0.1) },
            pendulum: form == Form::Constrained || random.chance(0.5),
            form,
            features,
            start: [x, v, random.between(-0.5, 0.5)],
            end,
            step_control,
        }
    }

    /// The parameters, by name.
    pub fn parameters(&self) -> Vec<(&'static str, f64)> {
        let own = [("m", self.m), ("k", self.k), ("gamma", self.gamma)];
        own.into_iter().chain(self.features.iter().flat_map(Feature::parameters)).collect()
    }

    /// The same with another value of a parameter, or of `x` or `x'` at the start.
    pub fn with(&self, name: &str, value: f64) -> Self {
        let mut changed = self.clone();
        match name {
            "m" => changed.m = value,
            "k" => changed.k = value,
            "gamma" => changed.gamma = value,
            "x" => changed.start[0] = value,
            "x'" => changed.start[1] = value,
            _ => changed.features = self.features.iter().map(|feature| feature.with(name, value)).collect(),
        }
        changed
    }

    /// The value of a parameter, or of `x` or `x'` at the start.
    pub fn value(&self, name: &str) -> f64 {
        match name {
            "x" => self.start[0],
            "x'" => self.start[1],
            _ => self.parameters().into_iter().find(|(own, _)| *own == name).unwrap().1,
        }
    }

    /// The system of the library; an error with the message where it is refused.
    pub fn system(&self) -> Result<System, String> {
        let mut potential = if self.pendulum { "k*(1 - cos(x))" } else { "k*x^2/2" }.to_owned();
        for text in self.features.iter().filter_map(Feature::potential) {
            potential += &format!(" + ({text})");
        }
        let tables: Vec<_> = self.features.iter().filter_map(Feature::table).collect();
        let parameters = self.parameters();
        let names = FormulaNames { tables: &tables, ..FormulaNames::new(&["x"], &parameters) };
        let both = FormulaNames::new(&["x", "y"], &parameters);
        let mut formula = match self.form {
            Form::Lagrangian => Formula::parse_lagrangian(&format!("m*x'^2/2 - ({potential}) + gamma*z"), &names),
            Form::Hamiltonian => Formula::parse_hamiltonian(&format!("p_x^2/(2*m) + {potential} - gamma*z"), &names),
            Form::Constrained => Formula::parse_lagrangian("m*(x'^2 + y'^2)/2 - k*(1 + y) + gamma*z", &both)
                .and_then(|formula| formula.with_constraints(&["x^2 + y^2 = 1"])),
        }
        .map_err(|error| error.to_string())?;
        for (i, coordinate) in formula.coordinates().iter().enumerate() {
            let forces: Vec<_> = self.features.iter().filter_map(|feature| feature.force(self.form, i)).collect();
            if !forces.is_empty() {
                formula = formula.with_force(coordinate, &forces.join(" + ")).map_err(|error| error.to_string())?;
            }
        }
        for feature in &self.features {
            let above = feature.wall().is_some_and(|a| self.start[0] > a);
            let direction = FormulaDirection::Falling;
            formula = match feature {
                Feature::Reset { .. } => {
                    let when = if above { "x - wall" } else { "wall - x" };
                    formula.with_reset(FormulaReset { when, direction, then: &[("x'", "-e*x'")], rest: None })
                }
                Feature::Impact { .. } => {
                    let when = if above { "x - surface" } else { "surface - x" };
                    formula.with_impact(when, Impact::Elastic, None)
                }
                Feature::MovingImpact { .. } => {
                    let surface = "x - (centre + amplitude*sin(frequency*t))";
                    let when = if above { surface.to_owned() } else { format!("-({surface})") };
                    formula.with_impact(&when, Impact::Elastic, None)
                }
                _ => Ok(formula),
            }
            .map_err(|error| error.to_string())?;
        }
        System::new(&formula).map_err(|error| error.to_string())
    }

    /// The function of the state that is zero where x is the value of an expression, as a text; for a pendulum also on the
    /// other side of the circle.
    pub fn crossing_of(&self, value: &str) -> String {
        match self.form {
            Form::Constrained => format!("x*cos({value}) + y*sin({value})"),
            _ => format!("x - ({value})"),
        }
    }

    /// The velocity as a text.
    pub fn velocity(&self) -> &'static str {
        match self.form {
            Form::Lagrangian => "x'",
            Form::Hamiltonian => "p_x/m",
            Form::Constrained => "x*y' - y*x'",
        }
    }

    /// The events of the terminal feature.
    pub fn events(&self, system: &System) -> Vec<Event> {
        let terminal = |text: &str| Event { terminal: true, ..Event::new(system.formula().expression(text).unwrap()) };
        self.features
            .iter()
            .filter_map(|feature| match feature {
                Feature::TerminalEvent { a: Some(_) } => Some(terminal(&self.crossing_of("end"))),
                Feature::TerminalEvent { a: None } => Some(terminal(self.velocity())),
                _ => None,
            })
            .collect()
    }

    /// The motion with the events of the terminal feature.
    pub fn motion(&self, system: &System) -> Motion {
        let [x, v, z] = self.start;
        let start = match self.form {
            Form::Lagrangian => Start::new(0.0, [x], [v], z),
            Form::Hamiltonian => Start { t: 0.0, q: vec![x], velocity: InitialVelocity::Momentum(vec![self.m * v]), z },
            Form::Constrained => Start::new(0.0, [x.sin(), -x.cos()], [x.cos() * v, x.sin() * v], z),
        };
        Motion { events: self.events(system), ..Motion::new(start, self.end, self.step_control) }
    }

    /// What is compared of a state of the reference: the first coordinate of the library, velocity and action.
    pub fn observed(&self, [x, v, z]: [f64; 3]) -> [f64; 3] {
        [if self.form == Form::Constrained { x.sin() } else { x }, v, z]
    }

    /// The same of a state of the library.
    pub fn observed_of(&self, q: &[f64], p: &[f64], z: f64) -> [f64; 3] {
        let v = if self.form == Form::Constrained { (q[0] * p[1] - q[1] * p[0]) / self.m } else { p[0] / self.m };
        [q[0], v, z]
    }
}
