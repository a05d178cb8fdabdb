//! Parse, dispatch, print the error, set the exit code.

mod cli;
mod commands;

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match commands::execute(cli::Cli::parse().command) {
        Ok(outcome) => {
            // Nobody may be listening (`lampyris plan ... | head`): the work is done all the same.
            let _ = std::io::stdout().write_all(outcome.text.as_bytes());
            ExitCode::from(outcome.exit as u8)
        }
        Err(error) => {
            eprintln!("lampyris: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
