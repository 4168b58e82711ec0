//! What scenes of each kind of system can do: every capability works, or is refused with a message that says why. The table is
//! the one list of what is missing in scenes; an entry that is better than the table says fails too, so that the table stays true.

use crate::support::{Directory, fail};

/// A kind of system: its tables, its start, a coordinate and its velocity, a parameter, and where a path ends.
struct Kind {
    name: &'static str,
    system: &'static str,
    start: &'static str,
    column: &'static str,
    velocity: &'static str,
    parameter: &'static str,
    ends: &'static str,
    /// The capabilities that it has not, with a part of the message.
    without: &'static [(&'static str, &'static str)],
}

const OF_TWO: &str = "x = 1.0\ny = 0.5\n\"x'\" = -0.1\n\"y'\" = 0.2\n";
const TO_TWO: &str = "x = 0.9\ny = 0.6\n";

const NOT_RUN_ONLY: &str = "works only with `herglotz run`";
const NOT_OF_BODIES: &str = "does not apply to a rigid body";
const NOT_OF_LARGE: &str = "takes a formula, which has at most 256 coordinates";

const KINDS: [Kind; 8] = [
    Kind {
        name: "L",
        system: "[system]\ncoordinates = [\"x\", \"y\"]\nlagrangian = \"(x'^2 + y'^2)/2 - k*(x^2 + 2*y^2)/2 + gamma*z\"\n\
                 parameters = { k = 1.3, gamma = -0.1 }\n",
        start: OF_TWO,
        column: "x",
        velocity: "x'",
        parameter: "k",
        ends: TO_TWO,
        without: &[],
    },
    Kind {
        name: "L with force",
        system: "[system]\ncoordinates = [\"x\", \"y\"]\nlagrangian = \"(x'^2 + y'^2)/2 - k*(x^2 + 2*y^2)/2 + gamma*z\"\n\
                 parameters = { k = 1.3, gamma = -0.1 }\n[force]\nx = \"-x'^3/5\"\n",
        start: OF_TWO,
        column: "x",
        velocity: "x'",
        parameter: "k",
        ends: TO_TWO,
        without: &[],
    },
    Kind {
        name: "H",
        system: "[system]\ncoordinates = [\"x\", \"y\"]\nhamiltonian = \"(p_x^2 + p_y^2)/2 + k*(x^2 + 2*y^2)/2 - gamma*z\"\n\
                 parameters = { k = 1.3, gamma = -0.1 }\n",
        start: "x = 1.0\ny = 0.5\np_x = -0.1\np_y = 0.2\n",
        column: "x",
        velocity: "p_x",
        parameter: "k",
        ends: TO_TWO,
        without: &[("resets", "Hamiltonian"), ("path", "for a Hamiltonian")],
    },
    Kind {
        name: "constraints",
        system: "[system]\ncoordinates = [\"x\", \"y\"]\nlagrangian = \"(x'^2 + y'^2)/2 - k*(x^2 + 2*y^2)/2 + gamma*z\"\n\
                 parameters = { k = 1.3, gamma = -0.1 }\nconstraints = [\"x^2 + y^2 = 5/4\"]\n",
        start: OF_TWO,
        column: "x",
        velocity: "x'",
        parameter: "k",
        ends: TO_TWO,
        without: &[
            ("resets", "combined with resets"),
            ("breaks", "steps under constraints do not end on them"),
            ("path", "not computed with constraints"),
        ],
    },
    Kind {
        name: "rigid body",
        system: "[system.body]\ninertia = [1.0, 2.0, 3.0]\nmass = 1.0\ncentre = [0.0, 0.1, 0.2]\ngravity = [0.0, 0.0, -1.0]\ngamma = -0.1\n",
        start: "omega = [1.0, 0.5, 0.25]\n",
        column: "tip_z",
        velocity: "omega1",
        parameter: "gamma",
        ends: "",
        without: &[
            ("resets", NOT_OF_BODIES),
            ("breaks", "remove `breaks`"),
            ("tables", NOT_OF_BODIES),
            ("compare", NOT_RUN_ONLY),
            ("fit", NOT_RUN_ONLY),
            ("Lyapunov exponents", "do not apply to a rigid body"),
            ("path", "body"),
        ],
    },
    Kind {
        name: "lattice",
        system: "[system]\nparameters = { k = 1.0, gamma = -0.1 }\n[system.lattice]\nsites = 4\nsite = \"x'^2/2 + k*cos(x) + gamma*z\"\n\
                 bond = \"-(xr - xl)^2/2\"\n",
        start: "x = [0.1, 0.3, 0.0, 0.2]\n",
        column: "x[0]",
        velocity: "x'[0]",
        parameter: "k",
        ends: "x = [0.0, 0.2, 0.1, 0.2]\n",
        without: &[],
    },
    Kind {
        name: "lattice of many sites",
        system: "[system]\nparameters = { k = 1.0, gamma = -0.1 }\n[system.lattice]\nsites = 300\nsite = \"x'^2/2 + k*cos(x) + gamma*z\"\n\
                 bond = \"-(xr - xl)^2/2\"\n",
        start: "x = \"0.1*sin(i)\"\n",
        column: "x[0]",
        velocity: "x'[0]",
        parameter: "k",
        ends: "x = 0.0\n",
        without: &[
            ("accuracy", NOT_OF_LARGE),
            ("events", NOT_OF_LARGE),
            ("terminal events", NOT_OF_LARGE),
            ("resets", NOT_OF_LARGE),
            ("breaks", NOT_OF_LARGE),
            ("tables", NOT_OF_LARGE),
            ("resume", "--resume does not apply to a lattice of many sites"),
            ("check", "from 1 to 256"),
            ("Lyapunov exponents", "from 1 to 256"),
            ("compare", "from 1 to 256"),
            ("sweep", "from 1 to 256"),
            ("fit", "from 1 to 256"),
            ("path", "from 1 to 256"),
        ],
    },
    Kind {
        name: "bodies",
        system: "[system]\nparameters = { G = 1.0, gamma = -0.1 }\n[system.bodies]\nmasses = [1.0, 0.5]\ndimensions = 2\n",
        start: "x_0 = 0.0\ny_0 = 0.0\nx_1 = 1.0\ny_1 = 0.0\n\"x_0'\" = 0.0\n\"y_0'\" = 0.0\n\"x_1'\" = 0.0\n\"y_1'\" = 1.0\n",
        column: "x_1",
        velocity: "x_1'",
        parameter: "gamma",
        ends: "x_0 = 0.0\ny_0 = 0.1\nx_1 = 0.9\ny_1 = 0.5\n",
        without: &[],
    },
];

const STEPS: &str = "integrator = \"gauss_2\"\nstep = 0.05\n";
const COMMANDS: [&str; 16] = [
    "given steps",
    "accuracy",
    "columns",
    "events",
    "terminal events",
    "resets",
    "backward",
    "breaks",
    "tables",
    "plan",
    "check",
    "Lyapunov exponents",
    "compare",
    "sweep",
    "fit",
    "path",
];

impl Kind {
    /// A scene of this kind.
    fn scene(&self, run: &str, more: &str) -> String {
        let Kind { system, start, .. } = self;
        format!("{system}[start]\n{start}[run]\n{run}{more}")
    }

    /// The command and the scene of a capability.
    fn of(&self, capability: &str) -> (&'static str, String) {
        let Kind { column, velocity, parameter, ends, .. } = self;
        let steps = format!("time = 1.0\n{STEPS}");
        let with = |more: &str| self.scene(&steps, more);
        let event = format!("[[want.events]]\nwhen = \"{column} - 0.1\"\n");
        match capability {
            "accuracy" => ("run", self.scene("time = 1.0\naccuracy = 1e-6\n", "")),
            "columns" => ("run", with(&format!("[want]\nrows = {{ every = 0.1, columns = [\"t\", \"{column}\"] }}\n"))),
            "events" => ("run", with(&event)),
            "terminal events" => ("run", with(&format!("{event}terminal = true\n"))),
            "resets" => ("run", with(&format!("{event}then = {{ \"{velocity}\" = \"0.1\" }}\n"))),
            "backward" => ("run", self.scene(&steps.replace("1.0", "-1.0"), "")),
            "breaks" => ("run", self.scene(&format!("{steps}breaks = [0.33]\n"), "")),
            "tables" => ("run", {
                let drive = "[tables.drive]\ntimes = [0.0, 1.0]\nvalues = [0.0, 0.1]\n";
                with(&format!("{drive}[[want.events]]\nwhen = \"{column} - drive(t)\"\n"))
            }),
            "check" => ("check", self.scene(&steps, "")),
            "Lyapunov exponents" => ("check --lyapunov", self.scene(&steps, "")),
            "compare" => ("compare", self.scene("time = 0.1\naccuracy = 1e-6\n", "")),
            "plan" => ("plan", self.scene(&steps, "")),
            "sweep" => ("sweep", with(&format!("[sweep]\n{parameter} = [-0.2, -0.1]\n"))),
            "fit" => ("fit", {
                let data = format!(
                    "[fit]\ncsv = \"data.csv\"\nobserve = {{ d = \"{column}\" }}\nunknowns = [\"{parameter}\"]\n"
                );
                with(&data)
            }),
            "path" => (
                "run",
                self.scene("steps = 8\nintegrator = \"midpoint\"\n", &format!("[ends]\n{ends}t = 1.0\n"))
                    .replace("\"x'\" = -0.1\n\"y'\" = 0.2\n", "")
                    .replace("p_x = -0.1\np_y = 0.2\n", "")
                    .replace("\"x_0'\" = 0.0\n\"y_0'\" = 0.0\n\"x_1'\" = 0.0\n\"y_1'\" = 1.0\n", ""),
            ),
            _ => ("run", with("")),
        }
    }
}

/// Whether a command does what it is asked for, or the message with which it refuses it.
fn found(at: &Directory, command: &str, text: &str) -> Result<(), String> {
    let file = at.write("scene.toml", text);
    let (name, more) = command.split_once(' ').map_or((command, None), |(name, more)| (name, Some(more)));
    let out = at.path("out");
    let mut arguments = vec![name, file.as_str()];
    arguments.extend(more);
    if matches!(name, "run" | "compare" | "sweep" | "fit") {
        arguments.extend(["--out", &out]);
    }
    match fail(&arguments) {
        (Some(0), _) => Ok(()),
        // A check whose result is no.
        (Some(1), message) if name == "check" && message.contains("not contact") => Ok(()),
        (_, message) => Err(message),
    }
}

#[test]
fn kinds_of_systems_and_what_they_can_do() {
    let at = Directory::new("kinds");
    at.write("data.csv", "t,d\n0.2,0.1\n0.4,0.12\n0.6,0.14\n0.8,0.15\n");
    let (mut works, mut cells, mut wrong) = (0, 0, Vec::new());
    for kind in &KINDS {
        for capability in COMMANDS.into_iter().chain(["resume"]) {
            let result = if capability == "resume" {
                let file = at
                    .write("scene.toml", &kind.scene(&format!("time = 1.0\n{}", STEPS.replace("0.05", "0.0001")), ""));
                let out = at.path("resumed");
                let interrupted = fail(&["run", &file, "--out", &out, "--interrupt-at", "0.3"]);
                match (interrupted, fail(&["run", &file, "--out", &out, "--resume"])) {
                    ((Some(1), _), (Some(0), _)) => Ok(()),
                    (_, (_, message)) => Err(message),
                }
            } else {
                let (command, text) = kind.of(capability);
                found(&at, command, &text)
            };
            let said = kind.without.iter().find(|(name, _)| *name == capability).map(|(_, message)| *message);
            let place = format!("{}, {capability}", kind.name);
            match (said, &result) {
                (None, Ok(())) => {}
                (None, Err(message)) => wrong.push(format!("{place}: {message}")),
                (Some(said), Err(message)) if message.contains(said) => {}
                (Some(said), Err(message)) => wrong.push(format!("{place}, not {said:?}: {message}")),
                (Some(_), Ok(())) => wrong.push(format!("{place}: it works; remove it from the table")),
            }
            (works, cells) = (works + usize::from(result.is_ok()), cells + 1);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // It may grow.
    assert!(works >= 111, "{works} of {cells}");
}
