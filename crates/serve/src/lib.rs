//! A service for questions about surrogates: JSON over HTTP/1.1, with limits on size, time and number of requests, a
//! token, metrics, and an end that answers the requests under way.
//!
//! The caller of [`run`] provides the answers with [`Answers`]; this crate knows requests alone.
//!
//! ```text
//!     connection --> door: places, slow clients, the end
//!                     guard: token, host, requests in flight, time, metrics
//!                      routes: which question of which surrogate --> Answers
//! ```
#![warn(missing_docs)]

mod answers;
mod connections;
mod guard;
mod metrics;
mod openapi;
mod routes;
mod settings;
mod shared_state;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

pub use answers::{Answers, Ask, Refusal, Reply, Work};
pub use settings::{Limits, Settings, Token};

/// Listens and answers until the process is asked to end (Ctrl-C, SIGTERM); requests under way are then still answered.
/// SIGHUP makes `answers` read changed files again. `listening` receives the address once connections are accepted; for
/// port 0 the system chooses a port.
///
/// # Errors
/// The service cannot listen at the address, or the system gives no threads.
pub fn run(answers: impl Answers, settings: &Settings, listening: impl FnOnce(SocketAddr)) -> io::Result<()> {
    let threads = settings.limits.threads.max(1);
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(threads).enable_all().build()?;
    let site = Arc::new(shared_state::Site::new(answers, settings));
    let ended = runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind(settings.address).await?;
        let end = connections::told_to_end()?;
        let rereading = Arc::clone(&site);
        tokio::spawn(connections::told_to_reread(move || rereading.reread())?);
        listening(listener.local_addr()?);
        connections::open(listener, &routes::router(site), settings.limits, end).await;
        Ok(())
    });
    // Work that outlives its time limit is not waited for.
    runtime.shutdown_timeout(std::time::Duration::from_millis(100));
    ended
}
