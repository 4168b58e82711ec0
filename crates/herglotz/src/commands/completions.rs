//! `herglotz completions`.

use clap::Command;
use clap::builder::PossibleValuesParser;
use clap_complete::Shell;
use herglotz::runtime::CATALOGUE;

/// The completions of a program for a shell.
pub(crate) fn text(shell: Shell, program: &Command) -> String {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut shown(program), "herglotz", &mut text);
    String::from_utf8_lossy(&text).into_owned()
}

/// A command without hidden options, which generators of completions show, and with the names of the catalogue where one
/// of its systems is named.
fn shown(command: &Command) -> Command {
    // The names of a command live as long as the program, which ends after it has printed them.
    let name: &'static str = command.get_name().to_owned().leak();
    let arguments = command.get_arguments().filter(|argument| !argument.is_hide_set()).cloned();
    let mut found = Command::new(name).args(arguments).subcommands(command.get_subcommands().map(shown));
    if let Some(about) = command.get_about() {
        found = found.about(about.clone());
    }
    if name == "new" {
        let names = || PossibleValuesParser::new(CATALOGUE.iter().map(|entry| entry.name));
        found = found
            .mut_args(|argument| if argument.get_id() == "name" { argument.value_parser(names()) } else { argument });
    }
    found
}
