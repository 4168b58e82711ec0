//! `herglotz new`.

use crate::failure::Failure;
use crate::output::print;
use clap::Args;
use herglotz::VERSION;
use herglotz::runtime::{CatalogueEntry, velocity_name};

#[derive(Args)]
pub(crate) struct New {
    /// The system of the catalogue to start from.
    #[arg(default_value = "pendulum")]
    name: String,
}

impl New {
    pub fn run(&self) -> Result<(), Failure> {
        let entry = CatalogueEntry::find(&self.name).map_err(|error| Failure::Input(error.to_string()))?;
        print(&template(entry)?)
    }
}

/// A number in TOML.
fn number(x: f64) -> String {
    format!("{x:?}")
}

/// A key in TOML: in quotes, unless it consists of letters, digits and `_`.
fn key(name: &str) -> String {
    let bare = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if bare { name.to_owned() } else { format!("\"{name}\"") }
}

/// A scene of a system, with comments.
fn template(entry: &CatalogueEntry) -> Result<String, Failure> {
    let formula = entry.formula().map_err(|error| Failure::Input(error.to_string()))?;
    let names = formula.coordinates();
    let blocks = entry.coordinates.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let parameters = entry.parameters.iter().map(|(name, value)| format!("{name} = {}", number(*value)));
    let parameters = parameters.collect::<Vec<_>>().join(", ");
    let lagrangian = match entry.lagrangian {
        several if several.contains('\n') => format!("\"\"\"\n{several}\"\"\""),
        one => format!("\"{one}\""),
    };
    let start = |name: &dyn Fn(&str) -> String, numbers: &[f64]| {
        let lines =
            names.iter().zip(numbers).map(|(coordinate, x)| format!("{} = {}", key(&name(coordinate)), number(*x)));
        lines.collect::<Vec<_>>().join("\n")
    };
    // The entries of an array are given one by one; a list is also accepted.
    let (q, v) = (start(&|name| name.to_owned(), entry.q), start(&velocity_name, entry.v));
    let first = names.first().map(String::as_str).unwrap_or("x");
    let swept = entry.parameters.last().map_or_else(
        || format!("\"start.{first}\" = {{ from = 0.0, to = 1.0, count = 11 }}"),
        |(name, value)| {
            let (from, to) = (number(2.0 * value), number(0.0));
            format!("{name} = {{ from = {from}, to = {to}, count = 11 }}  # or a list; spacing = \"log\"; \"start.{first}\" for the start")
        },
    );
    let t = if entry.t == 0.0 { String::new() } else { format!("t = {}\n", number(entry.t)) };
    Ok(format!(
        r#"# {about}. Run it by `herglotz run FILE`; `herglotz plan FILE` prints what will be computed.
version = {VERSION}

[system]
coordinates = [{blocks}]
# x' is the velocity of x, z the action, t the time; definitions are lines such as r = hypot(x, y).
lagrangian = {lagrangian}
parameters = {{ {parameters} }}

# Forces that no Lagrangian contains, as quadratic drag; `rayleigh = "..."` is Rayleigh's function:
# [force]
# {first_key} = "-0.1*{first_velocity}*abs({first_velocity})"

[start]
{q}
{v}
{t}# p_{first} instead of a velocity starts from momenta; z and t default to 0.

[run]
time = {time}
# breaks = [{middle}]  # times of jumps that the formulas do not show
accuracy = 1e-8  # or integrator = "gauss_8", step = 0.5; `herglotz list integrators` lists them

[want]
# Rows by every = TIME, at = [TIMES] or every_step = STEPS. Columns are names and any formulas; without them, the whole state.
# energy is v L_v - L (a drag gamma*z contributes -gamma*z), p_{first} a momentum, log_factor the integral of L_z, sigma its exponential.
rows = {{ every = 0.5, columns = ["t", "{first}", "{first_velocity}", "z", "energy", "log_factor", "{first}^2"] }}
# The times at which a formula changes its sign: direction = "rising", "falling" or "both"; terminal = true ends the motion.
# columns = ["..."] are recorded at each event in addition to the state; from = TIME skips earlier events.
events = [{{ when = "{first}", direction = "rising" }}]
# then = {{ "{first_velocity}" = "-0.8*{first_velocity}" }} gives a new state at each event, impact = "elastic" or {{ restitution = 0.8 }} a rebound.
# wrap = ["{first}"] shows an angle between -pi and pi in figures.

# For `herglotz sweep FILE`.
[sweep]
{swept}
"#,
        about = entry.about,
        first_velocity = velocity_name(first),
        first_key = key(first),
        middle = number(entry.t + 25.0),
        time = number(entry.t + 50.0),
    ))
}
