//! The reference of scene files, docs/scene_reference.md: it is made from the schema, with an example of each key from a
//! scene that is read.

use herglotz::AnyScene;
use herglotz::runtime::Formula;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Keys that no scene of the repository has.
const OTHERS: [&str; 5] = [
    r#"
system = { catalogue = "pendulum" }
start = { t = 0.0 }
run = { time = 10.0, integrator = "gauss_8", step = 0.1, exact = true, breaks = [2.5] }
want = { rows = { every_step = 10 }, conformal_factor = true, estimate = true }
sweep = { gamma = { from = -1.0, to = -0.1, count = 4, spacing = "log" } }
"#,
    r#"
[system]
coordinates = ["x", "y"]
lagrangian = "(x'^2 + y'^2)/2 - g*y"
parameters = { g = 9.81, mu = 0.2 }
[start]
x = 0.0
y = 1.0
"x'" = 1.0
"y'" = 0.0
[friction.x]
sliding = "mu*g"
sticking = "1.2*mu*g"
surface = "0.5*sin(t)"
[run]
time = 3.0
accuracy = 1e-8
scales = [1.0, 0.1]
[[want.events]]
when = "y"
impact = { restitution = 0.5 }
rest = { "y'" = "0" }
"#,
    r#"
[system]
coordinates = ["x"]
lagrangian = "x'^2/2 + x*drive(t)"
[tables.drive]
times = [0.0, 1.0, 3.0]
values = [0.0, 1.0, 0.5]
pieces = "cubic"
[start]
x = 0.0
"x'" = 0.0
[run]
time = 3.0
accuracy = 1e-8
[want]
rows = { at = [0.0, 1.0, 3.0] }
"#,
    r#"
[system.body]
inertia = [1.0, 2.0, 3.0]
torque = ["0", "0", "-0.1*omega3"]
[start]
omega = [0.0, 0.0, 2.0]
[run]
time = 3.0
accuracy = 1e-9
[[want.events]]
when = "omega3 - 1"
terminal = true
"#,
    r#"
[system]
coordinates = ["x"]
lagrangian = "x'^2/2 - k*x^2/2"
parameters = { k = 1.0 }
[start]
x = 1.0
"x'" = 0.0
[run]
time = 20.0
accuracy = 1e-9
[fit]
csv = "fit_spring.csv"
time = "t"
unknowns = ["k"]
observe = ["x"]
bounds = { k = [0.0, 10.0] }
starts = [{ k = 0.5 }]
loss = { huber = 2.0 }
pieces = 4
evaluations = 50
absolute_sigma = true
sigma = { x = 0.02 }
"#,
];

/// The folder of the scenes.
fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

/// The scenes from which examples are taken, with the names of those of the repository.
fn examples() -> Vec<(Option<String>, toml::Table)> {
    let mut all = Vec::new();
    let mut files: Vec<PathBuf> = std::fs::read_dir(scenes()).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    for file in files.iter().filter(|file| file.extension().is_some_and(|of| of == "toml")) {
        let name = file.file_stem().unwrap().to_str().unwrap().to_owned();
        all.push((Some(name), std::fs::read_to_string(file).unwrap()));
    }
    all.extend(OTHERS.map(|text| (None, text.to_owned())));
    all.push((None, OTHERS[4].replace("pieces = 4", "nodes = [5.0, 10.0]")));
    let read = |(name, text): (Option<String>, String)| {
        if let Err(error) = AnyScene::read_in(&text, &[], &scenes()) {
            panic!("{error}: {text}");
        }
        (name, text.parse().unwrap())
    };
    all.into_iter().map(read).collect()
}

/// A part of the schema behind its references, of which null is left out.
fn resolved<'s>(schema: &'s Value, part: &'s Value) -> &'s Value {
    if let Some(name) = part["$ref"].as_str() {
        return resolved(schema, &schema["$defs"][name.rsplit('/').next().unwrap()]);
    }
    match part["anyOf"].as_array() {
        Some(all) if all.len() == 2 && all[1]["type"] == "null" => resolved(schema, &all[0]),
        _ => part,
    }
}

/// The values at a path in a scene; `*` is every name, and the elements of lists count one by one.
fn values<'t>(at: &'t toml::Value, path: &[&str]) -> Vec<&'t toml::Value> {
    match (at, path) {
        (_, []) => vec![at],
        (toml::Value::Array(all), _) => all.iter().flat_map(|one| values(one, path)).collect(),
        (toml::Value::Table(table), ["*", rest @ ..]) => table.values().flat_map(|one| values(one, rest)).collect(),
        (toml::Value::Table(table), [name, rest @ ..]) => table.get(*name).map_or(Vec::new(), |one| values(one, rest)),
        _ => Vec::new(),
    }
}

/// The reference, and the keys without an example.
struct Reference<'s> {
    schema: &'s Value,
    examples: Vec<(Option<String>, toml::Table)>,
    text: String,
    missing: Vec<String>,
}

impl Reference<'_> {
    /// The shortest value of a key in any scene.
    fn example(&mut self, path: &[&str]) -> String {
        let key = path[path.len() - 1];
        let mut found: Vec<(String, Option<String>)> = Vec::new();
        for (name, table) in &self.examples {
            let table = toml::Value::Table(table.clone());
            found.extend(values(&table, path).iter().map(|value| (inline(value), name.clone())));
        }
        found.sort_by_key(|(text, name)| (text.len(), name.is_none(), text.clone(), name.clone()));
        let Some((text, name)) = found.into_iter().next() else {
            self.missing.push(path.join("."));
            return String::new();
        };
        let scene = name.map(|name| format!(" ([{name}](../scenes/{name}.toml))")).unwrap_or_default();
        format!("`{}`{scene}", format!("{key} = {text}").replace('|', "\\|"))
    }

    /// The keys of a table, and then those of the tables in it.
    fn section(&mut self, title: &str, table: &Value, path: &[&str]) {
        let about = |of: &Value| of["description"].as_str().unwrap_or_default().replace('\n', " ").replace('|', "\\|");
        self.text += &format!("\n## {title}\n");
        if !path.is_empty() {
            self.text += &format!("{}\n", about(table));
        }
        self.text += "\n| Key | Meaning | Example |\n|---|---|---|\n";
        let mut tables = Vec::new();
        for (key, part) in table["properties"].as_object().unwrap() {
            let inner = resolved(self.schema, part);
            let own = [path, &[key.as_str()]].concat();
            let meaning = if part["description"].is_null() { about(inner) } else { about(part) };
            let words = inner["oneOf"].as_array().into_iter().flatten().filter_map(|word| word["const"].as_str());
            let words: Vec<String> = words.map(|word| format!("`\"{word}\"`")).collect();
            let is_said = words.iter().all(|word| meaning.contains(word.as_str()));
            let meaning = if is_said { meaning } else { format!("{meaning} One of {}.", words.join(", ")) };
            let named = resolved(self.schema, &inner["additionalProperties"]);
            let of_list = resolved(self.schema, &inner["items"]);
            let mut example = String::new();
            if inner["properties"].is_object() && key != "bounds" && key != "sweep" {
                tables.push((own, inner.clone(), false));
            } else if named["properties"].is_object() {
                tables.push(([own.as_slice(), &["*"]].concat(), named.clone(), false));
            } else if of_list["properties"].is_object() && key != "starts" {
                tables.push((own, of_list.clone(), true));
            } else {
                example = self.example(&own);
            }
            self.text += &format!("| `{key}` | {meaning} | {example} |\n");
        }
        for (path, table, is_list) in tables {
            let name = path.join(".").replace('*', "NAME");
            let title = if is_list { format!("`[[{name}]]`") } else { format!("`[{name}]`") };
            self.section(&title, &table, &path);
        }
    }
}

/// A value in one line.
fn inline(value: &toml::Value) -> String {
    match value {
        toml::Value::Table(table) => {
            let key = |name: &str| match name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
                true => name.to_owned(),
                false => format!("\"{name}\""),
            };
            let all: Vec<String> =
                table.iter().map(|(name, value)| format!("{} = {}", key(name), inline(value))).collect();
            format!("{{ {} }}", all.join(", "))
        }
        toml::Value::Array(all) => format!("[{}]", all.iter().map(inline).collect::<Vec<_>>().join(", ")),
        toml::Value::String(text) => format!("{text:?}"),
        toml::Value::Float(x) => format!("{x:?}"),
        toml::Value::Integer(k) => k.to_string(),
        toml::Value::Boolean(is) => is.to_string(),
        toml::Value::Datetime(t) => t.to_string(),
    }
}

#[test]
fn the_reference_of_scenes_is_that_of_the_schema() {
    let schema = herglotz::schema();
    let mut reference = Reference { schema: &schema, examples: examples(), text: String::new(), missing: Vec::new() };
    reference.text += "# Scene files: every key\n\nThis page is made from the [schema](../scenes/scene.schema.json) of scene files; the examples are the shortest in the \
                       [scenes](scenes.md) of the repository. The formulas are those of [the language](formulas.md).\n";
    reference.section("Tables of a scene", &schema, &[]);
    assert!(reference.missing.is_empty(), "no example of {:?}", reference.missing);
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/scene_reference.md");
    let checked_in = std::fs::read_to_string(&docs).unwrap_or_default();
    if checked_in != reference.text {
        let new = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene_reference.md");
        std::fs::write(&new, &reference.text).unwrap();
        panic!("write it anew: cp {} docs/scene_reference.md", new.display());
    }
}

/// The text of a page.
fn page(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name)).unwrap()
}

/// Each example in docs/formulas.md has the value that the page says, and every function of the language has one.
#[test]
fn the_reference_of_formulas_is_that_of_the_language() {
    let formula = Formula::parse("x'^2/2 + k*z", &["x", "u[3]"], &[("k", 0.5)]).unwrap();
    let text = page("formulas.md");
    let mut evaluated = Vec::new();
    for row in text.lines().filter(|line| line.starts_with("| `")) {
        let Some((expression, value)) = row.rsplit('|').nth(1).and_then(|cell| cell.split_once("` = ")) else {
            continue;
        };
        let expression = expression.trim().trim_start_matches('`');
        let read = formula.expression(expression).unwrap_or_else(|error| panic!("{expression}: {error}"));
        let found = read.at(7.0, &[2.0, 1.0, 2.0, 4.0], &[3.0, 0.0, 0.0, 6.0], 5.0);
        let expected: f64 = value.trim().parse().unwrap();
        // A few roundings of functions.
        assert!((found - expected).abs() <= 1e-14 * expected.abs(), "{expression}: {found} for {expected}");
        evaluated.push(expression.to_owned());
    }
    // The language lists its functions where it meets an unknown one.
    let refused = formula.expression("wxyz(1)").unwrap_err().to_string();
    let (_, all) = refused.split_once("the functions are ").unwrap();
    let names: Vec<&str> = all.lines().next().unwrap().split(", ").map(|name| name.trim()).collect();
    assert!(names.len() > 25, "{names:?}");
    for name in names {
        let is_there = evaluated.iter().any(|expression| expression.contains(&format!("{name}(")));
        assert!(is_there && text.contains(&format!("`{name}(")), "{name} has no example");
    }
}
