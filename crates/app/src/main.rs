//! The `snapin` program: see [`snapin::run`].

use std::process::ExitCode;

fn main() -> ExitCode {
    snapin::crash::install();
    snapin::interrupt::install();
    let mut out = std::io::stdout().lock();
    let mut err = std::io::stderr();
    let code = snapin::run(std::env::args_os(), &mut out, &mut err);
    ExitCode::from(code)
}
