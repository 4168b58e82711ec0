//! The public entry points of a library, read from its sources.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The functions that a user of a crate can call: free functions by their name (with the module where it is public),
/// methods and constructors as `Type::function`, functions of traits as `Trait::function`. The sources are formatted by
/// rustfmt, so that what starts a line is at the top level.
pub fn of_crate(name: &str) -> BTreeSet<String> {
    of_folder(name, "")
}

/// Those of a folder of a crate.
pub fn of_folder(name: &str, within: &str) -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates").join(name).join("src");
    let lib = fs::read_to_string(root.join("lib.rs")).unwrap();
    let of_the_crate = exported(&lib);
    // A type of one public module may have functions in another.
    let folders: Vec<String> =
        lib.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).map(str::to_owned).collect();
    let of_folders = folders.iter().filter_map(|folder| fs::read_to_string(root.join(folder).join("mod.rs")).ok());
    let of_folders: Vec<String> = of_folders.collect();
    let of_folders: BTreeSet<&str> = of_folders.iter().flat_map(|text| exported(text)).collect();
    let mut entries = BTreeSet::new();
    for file in sources(&root.join(within)) {
        let relative = file.strip_prefix(&root).unwrap().with_extension("");
        // Tests are at the end of a file, or in a file of their own.
        let text = fs::read_to_string(&file).unwrap();
        let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        if relative.ends_with("tests") || relative.ends_with("order_conditions") {
            continue;
        }
        let mut parts = relative.iter().filter_map(|part| part.to_str()).filter(|part| *part != "mod");
        let (folder, inner) = (parts.next().unwrap_or_default(), parts.next());
        let own = inner.map(|_| fs::read_to_string(root.join(folder).join("mod.rs")).unwrap());
        // A public module, or a public module of a folder that is public or whose module the crate re-exports.
        let is_reached = |m: &str| of_the_crate.contains(m) || declares(&lib, folder);
        let handed_on = inner.zip(own.as_deref()).filter(|(m, own)| declares(own, m) && is_reached(m));
        let module = handed_on.map(|(m, _)| m).or(Some(folder).filter(|m| declares(&lib, m)));
        // All of a public module, but of a folder only what its `mod.rs` exports.
        let exported: Option<BTreeSet<&str>> = match (module, own.as_deref()) {
            (Some(m), Some(_)) if m == folder => Some(of_folders.union(&of_the_crate).copied().collect()),
            (Some(_), _) => None,
            // Of a private module what the crate or a public module exports.
            (None, _) => Some(of_folders.union(&of_the_crate).copied().collect()),
        };
        read(text, module, &|name| exported.as_ref().is_none_or(|names| names.contains(name)), &mut entries);
    }
    entries
}

/// Whether a file declares a public module.
fn declares(file: &str, module: &str) -> bool {
    file.lines().any(|line| line.strip_prefix("pub mod ").and_then(|m| m.strip_suffix(';')) == Some(module))
}

/// The names after `pub use`, also within a module of the file.
fn exported(lib: &str) -> BTreeSet<&str> {
    let uses = lib.split("pub use ").skip(1).filter_map(|u| u.split(';').next());
    uses.flat_map(|u| u.split(|c: char| !c.is_alphanumeric() && c != '_')).filter(|name| !name.is_empty()).collect()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found
}

/// The block that a line is in.
enum Within {
    File,
    /// The inherent functions of a type.
    Type(String),
    Trait(String),
    Module(String),
    /// The implementation of a trait, or a private type: no entry points.
    Other,
}

fn read(text: &str, module: Option<&str>, exported: &dyn Fn(&str) -> bool, entries: &mut BTreeSet<String>) {
    let mut within = Within::File;
    // The blocks inside a macro are indented, and count as well.
    for line in text.lines() {
        let code = line.trim_start();
        let deep = line.len() - code.len();
        let is_public = |name: &str| name.starts_with('$') || exported(name);
        if let Some(header) = code.strip_prefix("impl").filter(|h| deep % 8 == 0 && h.starts_with(['<', ' '])) {
            let (name, of_trait) = implemented(header);
            within = if of_trait || !is_public(&name) { Within::Other } else { Within::Type(name) };
        } else if let Some(header) = line.strip_prefix("pub trait ") {
            let name = identifier(header);
            within = if is_public(&name) { Within::Trait(name) } else { Within::Other };
        } else if let Some(header) = line.strip_prefix("pub mod ").filter(|h| h.ends_with('{')) {
            within = Within::Module(identifier(header));
        } else if line.starts_with('}') {
            within = Within::File;
        } else if let Some(function) = function(code, matches!(within, Within::Trait(_))) {
            let qualified = match (&within, module) {
                (Within::Type(of) | Within::Trait(of), _) => format!("{of}::{function}"),
                (Within::Module(of), _) => format!("{of}::{function}"),
                (Within::File, _) if deep != 0 || !exported(&function) => continue,
                (Within::File, Some(of)) => format!("{of}::{function}"),
                (Within::File, None) => function,
                _ => continue,
            };
            entries.insert(qualified);
        }
    }
}

/// The name of the function that a line declares: a public function, or any function of a trait.
fn function(code: &str, of_trait: bool) -> Option<String> {
    let public = ["pub fn ", "pub const fn "].iter().find_map(|start| code.strip_prefix(start));
    let declared = if of_trait { code.strip_prefix("fn ") } else { public };
    declared.map(identifier)
}

/// The type of an `impl` block from the text after `impl`, and whether the block implements a trait.
fn implemented(header: &str) -> (String, bool) {
    let mut rest = header;
    if rest.starts_with('<') {
        let mut depth = 0;
        let end = rest.char_indices().find(|(_, c)| {
            depth += i32::from(*c == '<') - i32::from(*c == '>');
            depth == 0
        });
        rest = &rest[end.map_or(0, |(i, _)| i + 1)..];
    }
    (identifier(rest.trim_start().trim_start_matches('&')), rest.contains(" for "))
}

fn identifier(text: &str) -> String {
    let path: String = text.chars().take_while(|c| c.is_alphanumeric() || "_$:".contains(*c)).collect();
    path.rsplit("::").next().unwrap_or_default().trim_end_matches(':').to_owned()
}
