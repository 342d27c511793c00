//! State common to all requests.

use std::sync::Arc;

use axum::body::Bytes;
use tokio::sync::Semaphore;

use crate::metrics::Metrics;
use crate::{Answers, Limits, Refusal, Settings, Token, openapi};

/// State common to all requests.
pub(crate) struct Site {
    pub(crate) answers: Box<dyn Answers>,
    pub(crate) openapi: Bytes,
    pub(crate) token: Option<Token>,
    pub(crate) limits: Limits,
    pub(crate) places: Semaphore,
    /// Places for long work; work keeps its place even if nobody waits for it any more.
    pub(crate) long: Arc<Semaphore>,
    pub(crate) metrics: Metrics,
}

impl Site {
    pub(crate) fn new(answers: impl Answers, settings: &Settings) -> Self {
        let described = openapi::describe(answers.schemas(), settings.token.is_some());
        Self {
            openapi: Bytes::from(described.to_string()),
            answers: Box::new(answers),
            token: settings.token.clone(),
            limits: settings.limits,
            places: Semaphore::new(settings.limits.in_flight),
            long: Arc::new(Semaphore::new(settings.limits.threads.max(1))),
            metrics: Metrics::new(),
        }
    }

    /// Reads the changed files of the answers again.
    pub(crate) fn reread(&self) {
        self.answers.reread();
    }

    pub(crate) fn missing(&self, name: &str) -> Refusal {
        let known = self.answers.names().join(", ");
        Refusal::new(404, format!("there is no surrogate '{name}'")).help(format!("there are: {known}"))
    }
}
