//! Other programs, in Python, that are measured in the same run.

use contact_examples::Failure;
use std::io::Write;
use std::process::{Command, Stdio};

/// What a program prints that reads an input; `None` where Python is not there, or the program ends with an error, as where it lacks a package.
///
/// # Errors
/// [`Failure::Terminal`] where the output cannot be read.
pub fn python(program: &str, input: &str) -> Result<Option<String>, Failure> {
    let child = Command::new("python3")
        .args(["-c", program])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut child) = child else { return Ok(None) };
    // Where it has ended already there is nothing to read.
    let _ = child.stdin.take().map(|mut stdin| stdin.write_all(input.as_bytes()));
    let output = child.wait_with_output().map_err(Failure::Terminal)?;
    Ok(output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned()))
}
