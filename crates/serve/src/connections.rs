//! Connections: a limited number, slow ones ended, and requests under way answered at the end.

use std::future::Future;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio_io_timeout::TimeoutStream;

use crate::Limits;

/// Wait before accepting again after the system had no file descriptor left, 50 ms. Chosen: no busy loop, no noticeable
/// delay.
const BREATH: Duration = Duration::from_millis(50);

/// Ends when the process is asked to end: by Ctrl-C, or by SIGTERM.
///
/// # Errors
/// The system does not allow a signal handler.
pub(crate) fn told_to_end() -> io::Result<impl Future<Output = ()>> {
    #[cfg(unix)]
    let mut terminate = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate())?;
    #[cfg(unix)]
    let mut interrupt = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::interrupt())?;
    Ok(async move {
        #[cfg(unix)]
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
        #[cfg(not(unix))]
        let _ = tokio::signal::ctrl_c().await;
    })
}

/// Calls `reread` whenever the process receives SIGHUP, on a thread where it may take its time; never on systems
/// without this signal.
///
/// # Errors
/// Errors of [`told_to_end`].
pub(crate) fn told_to_reread(reread: impl Fn() + Clone + Send + 'static) -> io::Result<impl Future<Output = ()>> {
    #[cfg(unix)]
    let mut told = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::hangup())?;
    Ok(async move {
        #[cfg(unix)]
        while told.recv().await.is_some() {
            // One at a time: signals that arrive meanwhile lead to one more call, afterwards.
            let _ = tokio::task::spawn_blocking(reread.clone()).await;
        }
        #[cfg(not(unix))]
        drop(reread);
    })
}

/// Accepts connections until `end`; then accepts no more, and waits for the requests under way.
pub(crate) async fn open(listener: TcpListener, router: &Router, limits: Limits, end: impl Future<Output = ()>) {
    let connections = GracefulShutdown::new();
    let places = Arc::new(Semaphore::new(limits.connections));
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(limits.slow);
    tokio::pin!(end);
    loop {
        let accept = async {
            // The semaphore is never closed.
            let place = Arc::clone(&places).acquire_owned().await.ok();
            (listener.accept().await, place)
        };
        let (accepted, place) = tokio::select! {
            biased;
            () = &mut end => break,
            accepted = accept => accepted,
        };
        let Ok((stream, _)) = accepted else {
            tokio::time::sleep(BREATH).await;
            continue;
        };
        // Without this, answers would wait for more data to send. A connection that is gone already shows when it is
        // read.
        let _ = stream.set_nodelay(true);
        let mut stream = TimeoutStream::new(stream);
        stream.set_read_timeout(Some(limits.time + limits.slow));
        stream.set_write_timeout(Some(limits.slow));
        let connection = http.serve_connection(TokioIo::new(Box::pin(stream)), TowerToHyperService::new(router.clone()));
        let connection = connections.watch(connection);
        tokio::spawn(async move {
            // Errors of a client on the wire do not concern the service.
            let _ = connection.await;
            drop(place);
        });
    }
    drop(listener);
    let _ = tokio::time::timeout(limits.time + limits.slow, connections.shutdown()).await;
}
