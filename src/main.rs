//! The `coldplate` program; see [`coldplate::cli`].

fn main() -> std::process::ExitCode {
    coldplate::cli::main()
}
