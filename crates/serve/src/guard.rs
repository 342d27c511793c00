//! Checks that every request passes: permission, number of requests in flight, time.

use std::sync::Arc;
use std::time::Instant;

use axum::extract::{MatchedPath, Request, State};
use axum::http::header::{AUTHORIZATION, CONTENT_TYPE, HOST, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value};

use crate::shared_state::Site;
use crate::{Refusal, Token};

/// Path that needs no token: whether the service lives is no secret.
const OPEN: &str = "/health";

/// Lets a request pass or refuses it, and counts it either way.
pub(crate) async fn guard(State(site): State<Arc<Site>>, request: Request, next: Next) -> Response {
    let began = Instant::now();
    let route = request.extensions().get::<MatchedPath>().cloned();
    let route = route.as_ref().map_or("none", MatchedPath::as_str);
    let response = match admitted(&site, route, request.uri(), request.headers()) {
        Ok(()) => answered(&site, request, next).await,
        Err(refusal) => refusal.into_response(),
    };
    site.metrics.answered(route, response.status().as_u16(), began.elapsed());
    response
}

fn admitted(site: &Site, route: &str, uri: &Uri, headers: &HeaderMap) -> Result<(), Refusal> {
    match &site.token {
        _ if route == OPEN => Ok(()),
        Some(token) if bears(headers, token) => Ok(()),
        Some(_) => Err(Refusal::new(401, "this service asks for its token").help("send it in the header: Authorization: Bearer TOKEN")),
        None if is_local(uri, headers) => Ok(()),
        // A page from elsewhere may have led a browser here under another name.
        None => Err(Refusal::new(403, "this service answers this machine alone").help("ask for it as localhost or 127.0.0.1")),
    }
}

fn bears(headers: &HeaderMap, token: &Token) -> bool {
    let given = headers.get(AUTHORIZATION).map(HeaderValue::as_bytes);
    let (scheme, given) = given.and_then(|given| given.split_at_checked(7)).unwrap_or_default();
    scheme.eq_ignore_ascii_case(b"Bearer ") && token.is(given)
}

/// Whether every name by which the request addresses this service belongs to this machine: the address may have one of
/// its own, and a header may occur twice.
fn is_local(uri: &Uri, headers: &HeaderMap) -> bool {
    let named = headers.get_all(HOST).iter().map(|host| host.to_str().unwrap_or(""));
    let hosts: Vec<&str> = uri.authority().map(Authority::as_str).into_iter().chain(named).collect();
    headers.contains_key(HOST) && hosts.into_iter().all(is_this_machine)
}

fn is_this_machine(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    };
    name.eq_ignore_ascii_case("localhost") || matches!(name, "127.0.0.1" | "[::1]")
}

async fn answered(site: &Site, request: Request, next: Next) -> Response {
    let Ok(_place) = site.places.try_acquire() else {
        return Refusal::new(503, "too many requests are being answered").help("ask again in a second").into_response();
    };
    site.metrics.in_flight.inc();
    let response = tokio::time::timeout(site.limits.time, next.run(request)).await;
    site.metrics.in_flight.dec();
    response.unwrap_or_else(|_| {
        let limit = site.limits.time.as_secs_f64();
        Refusal::new(504, format!("no answer within {limit} s")).help("ask for less at once").into_response()
    })
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let mut told = Map::from_iter([("message".to_owned(), Value::from(self.message))]);
        let further = [("key", self.key), ("help", self.help)];
        told.extend(further.into_iter().filter_map(|(key, text)| Some((key.to_owned(), Value::from(text?)))));
        let body = Value::from(Map::from_iter([("error".to_owned(), Value::from(told))])).to_string();
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = (status, [(CONTENT_TYPE, "application/json")], body).into_response();
        let header = match self.status {
            401 => Some((WWW_AUTHENTICATE, "Bearer")),
            503 => Some((RETRY_AFTER, "1")),
            _ => None,
        };
        response.headers_mut().extend(header.map(|(name, value)| (name, HeaderValue::from_static(value))));
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(name: axum::http::HeaderName, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_str(value).unwrap())])
    }

    #[test]
    fn names_of_this_machine() {
        let here = Uri::from_static("/surrogates");
        for host in ["localhost", "LOCALHOST:80", "127.0.0.1:8080", "[::1]", "[::1]:8080"] {
            assert!(is_local(&here, &with(HOST, host)), "{host}");
        }
        for host in ["", "example.org", "localhost.example.org", "127.0.0.1.example.org:80", "::1", "localhost:80:90"] {
            assert!(!is_local(&here, &with(HOST, host)), "{host}");
        }
        assert!(!is_local(&here, &HeaderMap::new()));
    }

    #[test]
    fn every_name_counts() {
        let mut two = with(HOST, "localhost");
        two.append(HOST, HeaderValue::from_static("example.org"));
        assert!(!is_local(&Uri::from_static("/surrogates"), &two));
        let one = with(HOST, "localhost");
        assert!(is_local(&Uri::from_static("http://127.0.0.1:8080/surrogates"), &one));
        assert!(!is_local(&Uri::from_static("http://example.org/surrogates"), &one));
    }

    #[test]
    fn the_token_is_borne() {
        let token = Token::new("0123456789abcdef").unwrap();
        assert!(bears(&with(AUTHORIZATION, "Bearer 0123456789abcdef"), &token));
        assert!(bears(&with(AUTHORIZATION, "bearer 0123456789abcdef"), &token));
        for wrong in ["", "Bearer", "Bearer ", "0123456789abcdef", "Basic 0123456789abcdef", "Bearer 0123456789abcdef "] {
            assert!(!bears(&with(AUTHORIZATION, wrong), &token), "{wrong}");
        }
    }
}
