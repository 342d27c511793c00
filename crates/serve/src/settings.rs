//! Address, permissions and limits of the service.

use std::fmt;
use std::net::SocketAddr;
use std::time::Duration;

use subtle::ConstantTimeEq;

/// Settings of a service.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Address to listen at.
    pub address: SocketAddr,
    /// Secret of the clients; without one only this machine is answered.
    pub token: Option<Token>,
    /// Limits on the load.
    pub limits: Limits,
}

/// Limits on the load at one time, and on durations.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Longest body of a request, in bytes.
    pub body: usize,
    /// Longest time from a request's head to its answer.
    pub time: Duration,
    /// Longest time in which a client sends a head, or a body, or takes a piece of an answer.
    pub slow: Duration,
    /// Number of requests answered at one time; others are told to come again.
    pub in_flight: usize,
    /// Number of connections; others wait to be accepted.
    pub connections: usize,
    /// Number of threads, and of long questions worked on at one time.
    pub threads: usize,
}

/// A secret between the service and its clients.
#[derive(Clone)]
pub struct Token(Vec<u8>);

impl Token {
    /// Shortest token, in bytes. Chosen: 16 random characters cannot be guessed.
    pub const SHORTEST: usize = 16;

    /// A token of visible ASCII characters, which a header can carry; `None` for another text or a shorter one.
    #[must_use]
    pub fn new(text: &str) -> Option<Self> {
        let fits = text.len() >= Self::SHORTEST && text.bytes().all(|b| b.is_ascii_graphic());
        fits.then(|| Self(text.as_bytes().to_vec()))
    }

    /// Whether a text is the token; the time taken does not reveal where the two differ.
    pub(crate) fn is(&self, other: &[u8]) -> bool {
        self.0.ct_eq(other).into()
    }
}

/// Secrets are not printed.
impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}

#[cfg(test)]
mod tests {
    use super::Token;

    #[test]
    fn tokens_are_long_enough_and_fit_a_header() {
        for wrong in ["", "short", "has a blank in it", "line\nend of a token", "umlauts are no ascü"] {
            assert!(Token::new(wrong).is_none(), "{wrong}");
        }
        let token = Token::new("0123456789abcdef").unwrap();
        assert!(token.is(b"0123456789abcdef") && !token.is(b"0123456789abcdeg") && !token.is(b"0123456789abcde"));
        assert_eq!(format!("{token:?}"), "Token");
    }
}
