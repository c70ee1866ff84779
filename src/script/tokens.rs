//! Words that Rhai keeps for itself and scripts use here: `spawn` is the name of a function, and `print` and `debug` are
//! functions of ours, which know their place. And `/` is an operator of ours, which keeps fractions.

use ::rhai::{Engine, Token};

use super::{rewrite, said};

pub fn register(engine: &mut Engine) {
    #[allow(
        deprecated,
        reason = "marked as volatile by Rhai, not as going away; the alternative is another word than users expect"
    )]
    engine.on_parse_token(|token, _, _| match token {
        Token::Reserved(word) if *word == "spawn" => Token::Identifier(word),
        Token::Reserved(word) | Token::Identifier(word) if *word == "print" => {
            Token::Identifier(Box::new(said::PRINT.into()))
        }
        Token::Reserved(word) | Token::Identifier(word) if *word == "debug" => {
            Token::Identifier(Box::new(said::DEBUG.into()))
        }
        Token::Divide => Token::Custom(Box::new(rewrite::DIVIDE.into())),
        other => other,
    });
}
