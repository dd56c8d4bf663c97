//! The `skyloom` command: see `skyloom --help`.

use std::process::ExitCode;

use skyloom_server::cli;

fn main() -> ExitCode {
    quiet_device_selection();
    match cli::main() {
        cli::HUNG => end_at_once(cli::HUNG),
        code => ExitCode::from(code),
    }
}

/// Mesa's layer that picks a default device looks for a desktop and complains on stderr where there is none. skyloom picks
/// its device itself, so the layer is told to stay out.
#[expect(unsafe_code, reason = "the environment is changed before there is a second thread")]
fn quiet_device_selection() {
    if std::env::var_os("NODEVICE_SELECT").is_none() {
        // SAFETY: the first statement of main: no other thread reads the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

/// Ends the process without what libraries do at its end: a driver that hangs waits there for its own threads, and the process would stay.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library only offers an end that calls exit handlers")]
fn end_at_once(code: u8) -> ! {
    // SAFETY: no memory is touched, and nothing runs after it.
    unsafe { libc::_exit(code.into()) }
}

#[cfg(not(unix))]
fn end_at_once(_: u8) -> ! {
    std::process::abort()
}
