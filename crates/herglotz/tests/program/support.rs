//! Common parts of the tests of the program: a directory, and runs of the program.

use std::path::PathBuf;
use std::process::{Command, Output};

pub const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A temporary directory of a test, removed when it is dropped.
pub struct Directory(PathBuf);

impl Directory {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("herglotz_{name}_{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Directory(path)
    }

    pub fn write(&self, name: &str, text: &str) -> String {
        std::fs::write(self.0.join(name), text).unwrap();
        self.path(name)
    }

    pub fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap()
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn herglotz(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_herglotz")).args(arguments).output().unwrap()
}

/// Runs the program successfully, and returns its standard output.
pub fn succeed(arguments: &[&str]) -> String {
    let output = herglotz(arguments);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {told}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program, and returns its exit code and its standard error.
pub fn fail(arguments: &[&str]) -> (Option<i32>, String) {
    let output = herglotz(arguments);
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// The numbers of a column of a table.
pub fn column(csv: &str, name: &str) -> Vec<f64> {
    let i = csv.lines().next().unwrap().split(',').position(|column| column == name).unwrap();
    csv.lines().skip(1).map(|line| line.split(',').nth(i).unwrap().parse().unwrap()).collect()
}

pub fn scene(name: &str) -> String {
    format!("{REPOSITORY}/scenes/{name}.toml")
}

/// Each change of a scene, given by one or several `from|to` pairs, is refused with a message that begins with the
/// expected text. `told` returns the message for a text.
pub fn refuses_each(scene: &str, changes: &[(&str, &str, &str)], told: impl Fn(&str) -> Option<String>) {
    for (from, to, expected) in changes {
        let mut to = to.split('|');
        let mut text = scene.replacen(from, to.next().unwrap(), 1);
        if let (Some(from), Some(to)) = (to.next(), to.next()) {
            text = text.replacen(from, to, 1);
        }
        assert_ne!(text, scene, "{from}");
        let found = told(&text);
        assert!(found.as_ref().is_some_and(|found| found.starts_with(expected)), "{found:?} for {expected:?}");
    }
}
