//! Counters, in the text format of OpenMetrics, which Prometheus reads.

use std::time::Duration;

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;

/// Upper ends of the histogram's bins, s. Chosen: from a fast single answer to the slowest work, in steps of two to
/// five.
const BINS: [f64; 12] = [50e-6, 100e-6, 250e-6, 500e-6, 1e-3, 2.5e-3, 5e-3, 25e-3, 100e-3, 500e-3, 2.5, 10.0];

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Route {
    route: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Outcome {
    route: String,
    status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct Asked {
    surrogate: String,
}

/// The counters of a service.
pub(crate) struct Metrics {
    registry: Registry,
    requests: Family<Outcome, Counter>,
    seconds: Family<Route, Histogram, fn() -> Histogram>,
    conditions: Family<Asked, Counter>,
    pub(crate) in_flight: Gauge,
}

impl Metrics {
    pub(crate) fn new() -> Self {
        let mut registry = Registry::with_prefix("coldplate");
        let requests = Family::<Outcome, Counter>::default();
        let seconds = Family::new_with_constructor((|| Histogram::new(BINS)) as fn() -> Histogram);
        let (conditions, in_flight) = (Family::<Asked, Counter>::default(), Gauge::default());
        registry.register("requests", "Requests by route and HTTP status", requests.clone());
        registry.register("request_seconds", "Time from the head of a request to its answer", seconds.clone());
        registry.register("conditions", "Conditions that were answered", conditions.clone());
        registry.register("requests_in_flight", "Requests that are being answered", in_flight.clone());
        Self { registry, requests, seconds, conditions, in_flight }
    }

    pub(crate) fn answered(&self, route: &str, status: u16, took: Duration) {
        self.requests.get_or_create(&Outcome { route: route.to_owned(), status }).inc();
        self.seconds.get_or_create(&Route { route: route.to_owned() }).observe(took.as_secs_f64());
    }

    pub(crate) fn conditions(&self, surrogate: &str, count: usize) {
        self.conditions.get_or_create(&Asked { surrogate: surrogate.to_owned() }).inc_by(count as u64);
    }

    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        // Writing into a text cannot fail.
        let _ = encode(&mut text, &self.registry);
        text
    }
}
