//! Parse, dispatch, print the error, set the exit code.

mod cli;
mod commands;

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match commands::execute(cli::Cli::parse().command) {
        Ok(outcome) => {
            say(&outcome.text);
            ExitCode::from(outcome.exit as u8)
        }
        Err(error) => {
            eprintln!("lampyris: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// Prints on standard output. Nobody may be listening (`lampyris plan ... | head`): the work is done all the same.
fn say(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// Prints on standard error what went wrong without ending anything.
fn warn(text: &str) {
    eprintln!("lampyris: {text}");
}
