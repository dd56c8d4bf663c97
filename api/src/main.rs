//! The `skyloom` command: see `skyloom --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    skyloom_server::cli::main()
}
