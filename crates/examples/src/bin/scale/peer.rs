//! Runs other programs, in Python, for comparison within the same measurement.

use contact_examples::Failure;
use std::io::Write;
use std::process::{Command, Stdio};

/// Runs a Python program on an input and returns its standard output; `None` where Python is not installed or the
/// program ends with an error, for example for lack of a package.
///
/// # Errors
/// Where the output cannot be read.
pub fn python(program: &str, input: &str) -> Result<Option<String>, Failure> {
    let child = Command::new("python3")
        .args(["-c", program])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut child) = child else { return Ok(None) };
    // A write fails if the program has already ended; its exit status decides below.
    let _ = child.stdin.take().map(|mut stdin| stdin.write_all(input.as_bytes()));
    let output = child.wait_with_output().map_err(Failure::terminal)?;
    Ok(output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned()))
}
