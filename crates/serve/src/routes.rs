//! Paths of the service and their answers.

use std::sync::Arc;

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::{Path, Query, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, X_CONTENT_TYPE_OPTIONS};
use axum::http::{HeaderMap, Request};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde_json::json;

use crate::guard::guard;
use crate::shared_state::Site;
use crate::{Ask, Refusal, Reply, Work};

/// Content type of JSON.
const JSON: &str = "application/json";
/// Content type of CSV.
const CSV: &str = "text/csv; charset=utf-8";
/// Content type of HTML.
const HTML: &str = "text/html; charset=utf-8";
/// Content type of metrics.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// Content policy of a page: it may use its own content, and nothing else.
const ITSELF: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";

type Here = State<Arc<Site>>;

/// Every path, behind the guard.
pub(crate) fn router(site: Arc<Site>) -> Router {
    Router::new()
        .route("/", get(front))
        .route("/health", get(health))
        .route("/metrics", get(metrics))
        .route("/openapi.json", get(description))
        .route("/surrogates", get(list))
        .route("/surrogates/{name}", get(info))
        .route("/surrogates/{name}/page", get(page))
        .route("/surrogates/{name}/query", post(query))
        .route("/surrogates/{name}/batch", post(batch))
        .route("/surrogates/{name}/table", post(table))
        .fallback(async || Refusal::new(404, "there is nothing here").help("GET /openapi.json lists all paths"))
        .method_not_allowed_fallback(async || {
            Refusal::new(405, "this is asked for by another method").help("GET /openapi.json says by which")
        })
        .layer(from_fn_with_state(Arc::clone(&site), guard))
        .with_state(site)
}

fn content(kind: &'static str, body: impl Into<Body>) -> Response {
    let headers = [(CONTENT_TYPE, kind), (CACHE_CONTROL, "no-store"), (X_CONTENT_TYPE_OPTIONS, "nosniff")];
    (headers, body.into()).into_response()
}

fn html(body: impl Into<Body>) -> Response {
    ([(CONTENT_SECURITY_POLICY, ITSELF)], content(HTML, body)).into_response()
}

/// The page of the only surrogate, or a list of links.
async fn front(State(site): Here) -> Response {
    let names = site.answers.names();
    match names {
        [only] => html(site.answers.page(only).unwrap_or_default()),
        several => {
            let items: String = several.iter().map(|name| format!("<li><a href=\"/surrogates/{name}/page\">{name}</a></li>\n")).collect();
            html(format!(
                "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
                 <title>coldplate</title>\n<style>body {{ font: 1rem/1.6 sans-serif; margin: 2rem; color-scheme: light dark }}</style>\n\
                 <h1>Surrogates</h1>\n<ul>\n{items}</ul>\n</html>\n"
            ))
        }
    }
}

async fn health(State(site): Here) -> Response {
    content(JSON, json!({"status": "ok", "version": env!("CARGO_PKG_VERSION"), "surrogates": site.answers.names().len()}).to_string())
}

async fn metrics(State(site): Here) -> Response {
    content(OPEN_METRICS, site.metrics.text())
}

async fn description(State(site): Here) -> Response {
    content(JSON, site.openapi.clone())
}

async fn list(State(site): Here) -> Response {
    content(JSON, json!({"surrogates": site.answers.names()}).to_string())
}

async fn info(State(site): Here, Path(name): Path<String>) -> Result<Response, Refusal> {
    site.answers.info(&name).map(|info| content(JSON, info)).ok_or_else(|| site.missing(&name))
}

async fn page(State(site): Here, Path(name): Path<String>) -> Result<Response, Refusal> {
    site.answers.page(&name).map(html).ok_or_else(|| site.missing(&name))
}

async fn query(State(site): Here, Path(name): Path<String>, request: Request<Body>) -> Result<Response, Refusal> {
    let body = body(&site, &name, request, "application/json").await?;
    Ok(content(JSON, answer(&site, &name, Ask::Query(body)).await?))
}

async fn batch(State(site): Here, Path(name): Path<String>, request: Request<Body>) -> Result<Response, Refusal> {
    let body = body(&site, &name, request, "application/json").await?;
    Ok(content(JSON, answer(&site, &name, Ask::Batch(body)).await?))
}

async fn table(
    State(site): Here,
    Path(name): Path<String>,
    Query(options): Query<Vec<(String, String)>>,
    request: Request<Body>,
) -> Result<Response, Refusal> {
    let rows = body(&site, &name, request, "text/csv").await?;
    Ok(content(CSV, answer(&site, &name, Ask::Table { rows, options }).await?))
}

/// The body of a request about an existing surrogate.
async fn body(site: &Site, name: &str, request: Request<Body>, kind: &'static str) -> Result<Vec<u8>, Refusal> {
    if !site.answers.names().iter().any(|own| own == name) {
        return Err(site.missing(name));
    }
    if !is_of_kind(request.headers(), kind) {
        return Err(Refusal::new(415, format!("the body is to be {kind}")).help(format!("send the header: Content-Type: {kind}")));
    }
    let (limit, slow) = (site.limits.body, site.limits.slow);
    let read = tokio::time::timeout(slow, to_bytes(request.into_body(), limit)).await;
    match read {
        Ok(Ok(bytes)) => Ok(bytes.into()),
        // The size is the only complaint of this reader; a broken connection receives nothing anyway.
        Ok(Err(_)) => Err(Refusal::new(413, format!("the body is longer than {limit} bytes, or broke off")).help("send it in parts")),
        Err(_) => Err(Refusal::new(408, format!("the body did not come within {} s", slow.as_secs_f64()))),
    }
}

/// Whether the header states a kind of body. A page from elsewhere cannot make a browser state it without asking first.
fn is_of_kind(headers: &HeaderMap, kind: &str) -> bool {
    let given = headers.get(CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
    given.split(';').next().is_some_and(|own| own.trim().eq_ignore_ascii_case(kind))
}

async fn answer(site: &Site, name: &str, ask: Ask) -> Result<Vec<u8>, Refusal> {
    let Reply { content, conditions } = match site.answers.ask(name, ask)? {
        Work::Done(reply) => reply,
        Work::Long(work) => {
            // The semaphore is never closed.
            let place = Arc::clone(&site.long).acquire_owned().await.ok();
            let worked = tokio::task::spawn_blocking(move || {
                let reply = work();
                drop(place);
                reply
            });
            worked.await.map_err(|_| Refusal::new(500, "the work on this question ended before its answer"))??
        }
    };
    site.metrics.conditions(name, conditions);
    Ok(content)
}
