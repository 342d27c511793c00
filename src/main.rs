//! The `coldplate` program; see [`coldplate::cli`].

/// A diagnosis solves small networks many times over, each time in memory of its own.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    coldplate::cli::main()
}
