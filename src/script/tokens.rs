//! Two words of grammar that Rhai lacks.
//!
//! `spawn` is a name here, not reserved. And `s.get("hero").yaw = 90` is an assignment: Rhai allows none to what a call
//! returns, so that `.get(...)` and `.material(...)` of `s` or `scene` are read as the index expressions `.get[...]` and
//! `.material[...]`, which it does allow. Lines and columns stay as they are.

use std::sync::{Mutex, PoisonError};

use ::rhai::{Engine, Token};

#[derive(Default)]
struct TokenMapper {
    /// The last three tokens, the latest first, as far as they matter here.
    last: [TokenClass; 3],
    /// For each open bracket whether it was turned into an index.
    open: Vec<bool>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum TokenClass {
    #[default]
    Other,
    Scene,
    Dot,
    Lookup,
}

pub fn register(engine: &mut Engine) {
    let state = Mutex::new(TokenMapper::default());
    #[allow(
        deprecated,
        reason = "marked as volatile by Rhai, not as going away; the alternative is another syntax than users expect"
    )]
    engine.on_parse_token(move |token, at, _| {
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        if at.line() == Some(1) && at.position() == Some(1) {
            *state = TokenMapper::default();
        }
        state.map(token)
    });
}

impl TokenMapper {
    fn map(&mut self, token: Token) -> Token {
        let token = match token {
            Token::Reserved(word) if *word == "spawn" => Token::Identifier(word),
            other => other,
        };
        let seen = match &token {
            Token::Identifier(name) if ["s", "scene"].contains(&name.as_str()) => TokenClass::Scene,
            Token::Identifier(name) if ["get", "material"].contains(&name.as_str()) => TokenClass::Lookup,
            Token::Period => TokenClass::Dot,
            _ => TokenClass::Other,
        };
        let looks_up = self.last == [TokenClass::Lookup, TokenClass::Dot, TokenClass::Scene];
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
