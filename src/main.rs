//! The thin binary: arguments in, exit code out.

fn main() -> std::process::ExitCode {
    anim::cli::main(std::env::args_os().collect())
}
