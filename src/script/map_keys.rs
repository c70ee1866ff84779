//! The keys of maps among the arguments of calls: what a mistake that the engine places at the call is about.

use ::rhai::{Engine, Token};

use super::rewrite;

/// Calls of a text and the keys of its maps, as bytes of it, in their order.
#[derive(Clone, Debug, Default)]
pub struct MapKeys {
    /// Where the name of each starts, and where its parentheses end.
    calls: Vec<(usize, usize)>,
    /// Where each starts and ends, without its quotes.
    keys: Vec<(usize, usize)>,
}

impl MapKeys {
    /// Of a text.
    pub fn new(engine: &Engine, text: &str) -> Self {
        let (tokens, starts) = (rewrite::tokens(engine, text), rewrite::line_starts(text));
        let partners = rewrite::partners(&tokens);
        let mut found = MapKeys::default();
        let place = |i: usize| rewrite::offset(text, &starts, tokens[i].1);
        for (i, (token, _)) in tokens.iter().enumerate() {
            let next = tokens.get(i + 1).map(|(token, _)| token);
            let before = i.checked_sub(1).map(|i| &tokens[i].0);
            let is_key = next == Some(&Token::Colon) && matches!(before, Some(Token::MapStart | Token::Comma));
            match token {
                Token::Identifier(_) if next == Some(&Token::LeftParen) => {
                    found.calls.push((place(i), partners[i + 1].map_or(text.len(), place)));
                }
                Token::Identifier(name) if is_key => found.keys.push((place(i), place(i) + name.len())),
                Token::StringConstant(name) if is_key => found.keys.push((place(i) + 1, place(i) + 1 + name.len())),
                _ => {}
            }
        }
        found
    }

    /// Those among the arguments of the call whose name starts here.
    pub fn of_call(&self, start: usize) -> &[(usize, usize)] {
        let Ok(call) = self.calls.binary_search_by_key(&start, |call| call.0) else { return &[] };
        let end = self.calls[call].1;
        let first = self.keys.partition_point(|key| key.0 < start);
        let last = self.keys.partition_point(|key| key.0 < end);
        &self.keys[first..last]
    }
}
