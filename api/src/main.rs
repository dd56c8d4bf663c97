//! The `skyloom` command: see `skyloom --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    quiet_device_selection();
    skyloom_server::cli::main()
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
