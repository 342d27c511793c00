//! The `coldplate` program: arguments, one call of the library, the result as text or JSON.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
