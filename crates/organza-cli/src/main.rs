//! The command `organza`: arguments → library calls → text or JSON, with one exit code for each kind of error.
//!
//! ```text
//! args ─► given (a scene, or one made of data files) ─► session (overrides, memory) ─► render convert extract explain accuracy orders view ─► report ─► console
//!         init info calibrate devices passport
//! ```
#![forbid(unsafe_code)]

mod accuracy;
mod args;
mod calibrate;
mod console;
mod convert;
mod devices;
mod explain;
mod extract;
mod given;
mod info;
mod init;
mod machine;
mod memory;
mod orders;
mod passport;
mod render;
mod report;
mod session;
#[cfg(feature = "view")]
mod view;

use args::{Arguments, Command, ManArguments};
use clap::{CommandFactory, Parser};
use organza::Error;
use std::panic::{self, AssertUnwindSafe};
use std::process::ExitCode;

fn main() -> ExitCode {
    console::signals::block_ignored();
    ExitCode::from(guard(|| {
        let arguments = match Arguments::try_parse() {
            Ok(arguments) => arguments,
            // Help and version are not errors; a closed pipe is not worth a word.
            Err(e) if e.exit_code() == 0 => return console::out(&e.render().to_string()).map_or(4, |()| 0),
            Err(e) => {
                console::note(&without_floods(&e.render().to_string()));
                return 2;
            }
        };
        console::set_loudness(arguments.quiet, arguments.verbose);
        let wants_json = arguments.command.wants_json();
        match run(arguments.command) {
            Ok(code) => code,
            Err(error) => {
                console::report_error(&error, wants_json);
                error.exit_code()
            }
        }
    }))
}

/// A message of the parser of arguments, which repeats them whole, with its long lines cut.
fn without_floods(message: &str) -> String {
    const MOST_LINES: usize = 20;
    message.lines().take(MOST_LINES).map(|line| organza::printable(line.as_ref()) + "\n").collect()
}

/// The exit code of a command that has said what it had to say.
fn run(command: Command) -> Result<u8, Error> {
    console::signals::listen()?;
    console::signals::end_aborts_as_limits()?;
    match command {
        Command::Render(arguments) => return render::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Extract(arguments) => extract::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Accuracy(arguments) => accuracy::run(&arguments),
        Command::Orders(arguments) => orders::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Devices(arguments) => devices::run(&arguments),
        Command::Passport(arguments) => return passport::run(&arguments),
        #[cfg(feature = "view")]
        Command::View(arguments) => view::run(&arguments),
        Command::Completions(arguments) => {
            let mut script = Vec::new();
            clap_complete::generate(arguments.shell, &mut Arguments::command(), "organza", &mut script);
            console::out(&String::from_utf8_lossy(&script))
        }
        Command::Man(arguments) => man(&arguments),
        Command::Schema => console::out(&(organza::scene::schema() + "\n")),
    }
    .map(|()| 0)
}

/// Prints the manual page of the command, or of one of its commands.
fn man(arguments: &ManArguments) -> Result<(), Error> {
    let mut command = Arguments::command();
    command.build();
    let command = match &arguments.command {
        None => command,
        Some(name) => {
            let names = || command.get_subcommands().map(clap::Command::get_name).collect::<Vec<_>>().join(", ");
            let missing = || {
                Error::usage(
                    format!("man: there is no command {}", organza::shown(name)),
                    format!("there are {}", names()),
                )
            };
            command.find_subcommand(name).ok_or_else(missing)?.clone()
        }
    };
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page).map_err(|e| Error::Internal(format!("manual page: {e}")))?;
    console::out(&String::from_utf8_lossy(&page))
}

/// Runs `work`; a panic is a bug of ours, says so and gives 1.
fn guard(work: impl FnOnce() -> u8) -> u8 {
    panic::set_hook(Box::new(|info| {
        // A decoder that gives up on a damaged file; the reader makes an error of it.
        if read::panic_is_input_error() {
            return;
        }
        let version = env!("CARGO_PKG_VERSION");
        console::note(&format!("error: bug in Organza {version}, please report it with the scene: {info}\n"));
    }));
    panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_panic_is_exit_code_1() {
        assert_eq!(super::guard(|| panic!("on purpose")), 1);
        assert_eq!(super::guard(|| 3), 3);
    }
}
