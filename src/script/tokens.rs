//! Two words of grammar that Rhai lacks.
//!
//! `spawn` is a name here, not reserved. And `s.get("hero").yaw = 90` is an assignment: Rhai allows none to what a call
//! returns, so that `.get(...)` and `.material(...)` of `s` or `scene` are read as the index expressions `.get[...]` and
//! `.material[...]`, which it does allow. Lines and columns stay as they are.

use std::sync::{Mutex, PoisonError};

use ::rhai::{Engine, Token};

#[derive(Default)]
struct State {
    /// The last three tokens, the latest first, as far as they matter here.
    last: [Seen; 3],
    /// For each open bracket whether it was turned into an index.
    open: Vec<bool>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum Seen {
    #[default]
    Other,
    Scene,
    Dot,
    Lookup,
}

pub fn register(engine: &mut Engine) {
    let state = Mutex::new(State::default());
    #[allow(
        deprecated,
        reason = "marked as volatile by Rhai, not as going away; the alternative is another syntax than users expect"
    )]
    engine.on_parse_token(move |token, at, _| {
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        if at.line() == Some(1) && at.position() == Some(1) {
            *state = State::default();
        }
        state.map(token)
    });
}

impl State {
    fn map(&mut self, token: Token) -> Token {
        let token = match token {
            Token::Reserved(word) if *word == "spawn" => Token::Identifier(word),
            other => other,
        };
        let seen = match &token {
            Token::Identifier(name) if ["s", "scene"].contains(&name.as_str()) => Seen::Scene,
            Token::Identifier(name) if ["get", "material"].contains(&name.as_str()) => Seen::Lookup,
            Token::Period => Seen::Dot,
            _ => Seen::Other,
        };
        let looks_up = self.last == [Seen::Lookup, Seen::Dot, Seen::Scene];
        self.last = [seen, self.last[0], self.last[1]];
        match token {
            Token::LeftParen => {
                self.open.push(looks_up);
                if looks_up { Token::LeftBracket } else { Token::LeftParen }
            }
            Token::RightParen if self.open.pop() == Some(true) => Token::RightBracket,
            other => other,
        }
    }
}
