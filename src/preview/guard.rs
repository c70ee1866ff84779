//! Who gets in: only the user whom the address was printed for.
//!
//! The server listens on the loopback alone. A page of another site may still make a browser ask it, under its own name or
//! under one that it lets lead here (DNS rebinding): so `Host` and `Origin` must be those of the address that was printed.
//! Other users of the machine can reach the loopback too: so everything asks for the token in the address.

use crate::base::diagnostics::{Cause, Diagnostic};

/// A secret of this run of the program.
#[derive(Clone, Debug)]
pub struct AccessToken(String);

impl AccessToken {
    /// A token that nobody can guess.
    ///
    /// # Errors
    /// The system has no random numbers to give.
    pub fn new() -> Result<AccessToken, Diagnostic> {
        let mut bytes = [0; 16];
        let failed = |e| Diagnostic::error(format!("cannot make a secret for the page: {e}")).because(Cause::Io);
        getrandom::fill(&mut bytes).map_err(failed)?;
        Ok(AccessToken(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// The secret as it stands in the page's address.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// Whether it is this one; how long that takes says nothing of how much of it is right.
    pub fn is(&self, given: &str) -> bool {
        let differences = self.0.bytes().zip(given.bytes()).fold(0, |found, (a, b)| found | (a ^ b));
        given.len() == self.0.len() && differences == 0
    }
}

/// What a request says of itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Credentials<'a> {
    /// The header `Host`.
    pub host: Option<&'a str>,
    /// The header `Origin`; browsers send none with pages that a person opens.
    pub origin: Option<&'a str>,
    /// Where the browser says that the request comes from.
    pub fetch_site: Option<&'a str>,
    /// The secret that it carries.
    pub token: Option<&'a str>,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Another name of this machine, or of another one.
    Host,
    /// It comes from a page that is not ours.
    Origin,
    /// Without the token, or with another one.
    Token,
}

/// Sees to it that a request comes from the page of this server at `port`.
///
/// # Errors
/// Why it does not.
pub fn admit(request: Credentials, port: u16, token: &AccessToken) -> Result<(), Refusal> {
    let names = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let is_ours = |host: &str| names.iter().any(|name| name == host);
    let Some(host) = request.host.filter(|host| is_ours(host)) else { return Err(Refusal::Host) };
    if request.origin.is_some_and(|origin| origin != format!("http://{host}")) {
        return Err(Refusal::Origin);
    }
    // `none` is an address that a person has typed or clicked outside of a page.
    if request.fetch_site.is_some_and(|site| !["same-origin", "none"].contains(&site)) {
        return Err(Refusal::Origin);
    }
    if request.token.is_some_and(|given| token.is(given)) { Ok(()) } else { Err(Refusal::Token) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_page_of_this_server_is_let_in() {
        let token = AccessToken::new().unwrap();
        let other = AccessToken::new().unwrap();
        assert_ne!(token.text(), other.text());
        let good = Credentials {
            host: Some("127.0.0.1:80"),
            origin: None,
            fetch_site: Some("same-origin"),
            token: Some(token.text()),
        };
        let said = |request| admit(request, 80, &token);
        assert_eq!(said(good), Ok(()));
        let local = Credentials { host: Some("localhost:80"), origin: Some("http://localhost:80"), ..good };
        assert_eq!(said(local), Ok(()));
        for host in [None, Some("evil.example:80"), Some("127.0.0.1:81"), Some("127.0.0.1"), Some("")] {
            assert_eq!(said(Credentials { host, ..good }), Err(Refusal::Host), "{host:?}");
        }
        for origin in ["http://evil.example", "null", "https://127.0.0.1:80", "http://localhost:80", ""] {
            assert_eq!(said(Credentials { origin: Some(origin), ..good }), Err(Refusal::Origin), "{origin}");
        }
        for site in ["cross-site", "same-site"] {
            assert_eq!(said(Credentials { fetch_site: Some(site), ..good }), Err(Refusal::Origin));
        }
        for wrong in [None, Some(""), Some(other.text()), Some(&token.text()[1..])] {
            assert_eq!(said(Credentials { token: wrong, ..good }), Err(Refusal::Token));
        }
    }
}
