//! Forms of other languages that the engine's grammar trips over: where they begin, and how the same is written here.

use ::rhai::{Position, Token};

use super::rewrite::{self, PlacedToken};
use super::words::{self, Words};

/// What stands around the place of a mistake of grammar.
struct Surroundings<'a> {
    tokens: &'a [PlacedToken],
    partners: Vec<Option<usize>>,
    /// The token at the place.
    at: usize,
    /// The first token of the statement, as far as braces and semicolons tell.
    start: usize,
}

/// The form of another language that a mistake of grammar is a part of, if it is one that is known: where to show it, and
/// what to say.
pub fn form_at(tokens: &[PlacedToken], at: Position, text: &str) -> Option<(Position, Words)> {
    if let Some(found) = directive(at, text) {
        return Some(found);
    }
    let order = |place: Position| (place.line(), place.position());
    let index = tokens.iter().position(|(_, place)| order(*place) >= order(at)).unwrap_or(tokens.len());
    let at = index.min(tokens.len().checked_sub(1)?);
    let ends = |token: &Token| matches!(token, Token::SemiColon | Token::LeftBrace | Token::RightBrace);
    let start = tokens[..at].iter().rposition(|(token, _)| ends(token)).map_or(0, |end| end + 1);
    let around = Surroundings { tokens, partners: rewrite::partners(tokens), at, start };
    // Words that are known as foreign are told as such.
    let is_foreign = |i: usize| around.word(i).is_some_and(|word| word != "not" && words::foreign(word).is_some());
    if is_foreign(at) || at.checked_sub(1).is_some_and(is_foreign) {
        return None;
    }
    let (i, message, help) = around.named_word().or_else(|| around.loops()).or_else(|| around.brackets())?;
    let place = tokens.get(i).map(|(_, place)| *place)?;
    Some((place, (message.into(), Some(help.into()))))
}

/// Which token it is, what is wrong, and what to write.
type ForeignForm = (usize, &'static str, &'static str);

impl Surroundings<'_> {
    fn token(&self, i: usize) -> Option<&Token> {
        self.tokens.get(i).map(|(token, _)| token)
    }

    /// The token so many before the place.
    fn before(&self, count: usize) -> Option<&Token> {
        self.token(self.at.checked_sub(count)?)
    }

    fn word(&self, i: usize) -> Option<&str> {
        match self.token(i)? {
            Token::Identifier(word) | Token::Reserved(word) => Some(word),
            _ => None,
        }
    }

    /// Whether a token stands right behind the one before it.
    fn is_joined(&self, i: usize) -> bool {
        let (Some((token, before)), Some((_, after))) =
            (i.checked_sub(1).and_then(|i| self.tokens.get(i)), self.tokens.get(i))
        else {
            return false;
        };
        let width = match token {
            Token::StringConstant(text) => text.chars().count() + 2,
            other => other.to_string().chars().count(),
        };
        let end = before.position().unwrap_or(0) + width;
        before.line() == after.line() && Some(end) >= after.position()
    }

    /// Words that belong to declarations, calls and texts of other languages.
    fn named_word(&self) -> Option<ForeignForm> {
        let at = self.at;
        let is_value = |token: Option<&Token>| {
            matches!(
                token,
                Some(
                    Token::Identifier(_)
                        | Token::IntegerConstant(_)
                        | Token::FloatConstant(_)
                        | Token::StringConstant(_)
                )
            )
        };
        for i in self.start..at {
            let is_field = i > 0 && matches!(self.token(i - 1), Some(Token::Period));
            match self.word(i).filter(|_| !is_field) {
                Some("function" | "func" | "lambda") => {
                    return Some((
                        i,
                        "functions are written otherwise here",
                        "a closure is written |x| x + 1, a function fn name(x) { ... }",
                    ));
                }
                Some("not") if i + 1 == at => {
                    return Some((i, "`not` is not a word of this language", "write `!` for `not`"));
                }
                Some("mut") if i > 0 && self.token(i - 1) == Some(&Token::Let) => {
                    return Some((
                        i,
                        "`mut` is not a word of this language",
                        "every variable can change: let name = ...;",
                    ));
                }
                _ => {}
            }
        }
        if let (Some("f" | "r" | "b" | "F"), Some(Token::StringConstant(_))) =
            (self.word(at.checked_sub(1)?), self.token(at))
            && self.is_joined(at)
        {
            let message = "a text with values in it stands in backticks";
            return Some((at - 1, message, "write `frame ${f.number}`"));
        }
        if let (Some(Token::StringConstant(text)), Some(Token::StringConstant(_) | Token::InterpolatedString(_))) =
            (self.before(1), self.token(at))
            && text.is_empty()
            && self.is_joined(at)
        {
            return Some((
                at - 1,
                "there are no triple quotes",
                "a text of several lines stands in backticks, a comment behind //",
            ));
        }
        if self.tokens[at].1.line() != self.tokens[at - 1].1.line() {
            return None;
        }
        let is_let = |i: Option<usize>| i.and_then(|i| self.token(i)) == Some(&Token::Let);
        let tuple = "one variable at a time";
        match self.token(at) {
            Some(Token::LeftParen | Token::LeftBracket | Token::MapStart) if is_let(at.checked_sub(1)) => {
                return Some((at, tuple, "let a = list[0]; let b = list[1];"));
            }
            Some(Token::Comma) if is_let(at.checked_sub(2)) => return Some((at, tuple, "let a = 1; let b = 2;")),
            Some(Token::Colon) if is_let(at.checked_sub(2)) => {
                return Some((at, "a variable has no type", "write let name = ...;"));
            }
            Some(Token::Identifier(_))
                if self.is_joined(at)
                    && matches!(self.before(1), Some(Token::IntegerConstant(_) | Token::FloatConstant(_))) =>
            {
                let message = "a number has no unit behind it";
                return Some((at, message, "angles are in degrees, lengths in world units: write the number alone"));
            }
            Some(Token::If) if is_value(self.before(1)) || self.before(1) == Some(&Token::RightParen) => {
                return Some((at, "a choice is written otherwise here", "write if a { b } else { c }"));
            }
            Some(Token::Identifier(_)) if at >= 1 && at - 1 == self.start && self.word(at - 1).is_some() => {
                // Two words in a row: a declaration with a type, or a call without brackets.
                let is_declaration = matches!(self.token(at + 1), Some(Token::Equals | Token::SemiColon));
                return Some(if is_declaration {
                    (at - 1, "a variable is declared otherwise here", "write let name = ...;")
                } else {
                    (at - 1, "two words stand in a row", "functions are called with brackets: name(x)")
                });
            }
            Some(Token::StringConstant(_)) if self.word(at - 1).is_some() => {
                return Some((at - 1, "functions are called with brackets", "write name(\"text\")"));
            }
            _ => {}
        }
        None
    }

    /// Loops that count, and closures.
    fn loops(&self) -> Option<ForeignForm> {
        let counting = ("loops go through lists and ranges", "to count, write for i in 0..10 { ... }");
        // The head of a loop in brackets has semicolons in it, where the statement seems to begin.
        let line = self.tokens[self.at].1.line();
        let on_line = |i: &usize| self.tokens[*i].1.line() == line;
        let head = (0..self.at).rev().take_while(on_line).find(|i| self.token(*i) == Some(&Token::For));
        if let Some(head) = head {
            let opens = self.token(head + 1) == Some(&Token::LeftParen);
            let has_block = self.tokens[head..self.at].iter().any(|(token, _)| *token == Token::LeftBrace);
            let counts = self.tokens[head..=self.at]
                .iter()
                .any(|(token, _)| matches!(token, Token::Equals | Token::Let | Token::SemiColon));
            if !has_block && (counts || (opens && matches!(self.token(self.at), Some(Token::Equals | Token::Let)))) {
                return Some((self.at, counting.0, counting.1));
            }
        }
        match self.token(self.at) {
            Some(Token::DoubleArrow) => Some((self.at, "closures are written otherwise here", "write |x| x + 1")),
            _ => None,
        }
    }

    /// Whether a brace begins the block of a statement rather than a value.
    fn is_block(&self, open: usize) -> bool {
        let line = self.tokens[open].1.line();
        let mut before = self.tokens[..open].iter().rev().take_while(|(_, place)| place.line() == line);
        let words =
            [Token::Switch, Token::If, Token::Else, Token::While, Token::For, Token::Fn, Token::Loop, Token::Do];
        before.any(|(token, _)| words.contains(token))
    }

    /// Vectors, maps and arguments in the brackets of other languages.
    fn brackets(&self) -> Option<ForeignForm> {
        let at = self.at;
        let opening = (0..at).rev().find(|i| {
            let opens = matches!(
                self.token(*i),
                Some(Token::LeftParen | Token::LeftBracket | Token::LeftBrace | Token::MapStart)
            );
            opens && self.partners[*i].is_none_or(|close| close >= at)
        });
        let before_opening = opening.and_then(|open| open.checked_sub(1)).and_then(|i| self.token(i));
        let is_call = matches!(before_opening, Some(Token::Identifier(_)));
        let is_function = opening.and_then(|open| open.checked_sub(2)).and_then(|i| self.token(i)) == Some(&Token::Fn);
        let opens = |token: Token| opening.filter(|open| self.token(*open) == Some(&token));
        match self.token(at)? {
            Token::Colon if opens(Token::LeftBrace).is_some_and(|open| open + 2 == at && !self.is_block(open)) => {
                Some((at - 2, "a map begins with #{", "write #{ name: value, other: value }"))
            }
            Token::Colon if opens(Token::LeftParen).is_some() && is_function => {
                Some((at, "parameters have no types", "write fn name(a, b) { ... }"))
            }
            Token::Colon | Token::Equals if opens(Token::LeftParen).is_some() && is_call => Some((
                at,
                "arguments have no names here",
                "give them in their order; some functions take a map of options",
            )),
            Token::Colon if opens(Token::LeftBracket).is_some() => {
                Some((at, "a part of a list is a range", "write list[1..3]"))
            }
            Token::Comma if opens(Token::LeftParen).is_some() && !is_call => {
                Some((opening?, "lists and vectors stand in square brackets", "write [1, 2, 3]"))
            }
            Token::Comma if opening.is_none_or(|open| self.token(open) == Some(&Token::LeftBrace)) => {
                let is_digits = |token: Option<&Token>| matches!(token, Some(Token::IntegerConstant(_)));
                (is_digits(self.before(1)) && is_digits(self.token(at + 1))).then_some((
                    at,
                    "decimals begin with a point",
                    "write 0.5, not 0,5",
                ))
            }
            Token::LessThan if matches!(self.before(1), Some(Token::Equals | Token::Comma | Token::LeftParen)) => {
                Some((at, "a vector stands in square brackets", "write [1, 2, 3]"))
            }
            _ => None,
        }
    }
}

/// A directive of POV-Ray, or of the preprocessor of C, that begins at the place.
fn directive(at: Position, text: &str) -> Option<(Position, Words)> {
    let line = text.lines().nth(at.line()?.checked_sub(1)?)?;
    let rest: String = line.chars().skip(at.position()?.checked_sub(1)?).collect();
    let word: String = rest.strip_prefix('#')?.chars().take_while(|c| c.is_alphabetic()).collect();
    let help = match word.as_str() {
        "declare" | "local" | "define" | "default" | "undef" => {
            "a value gets its name by let name = 1; or const NAME = 1;"
        }
        "macro" => "a function is written fn name(a, b) { ... }",
        "while" | "for" | "if" | "else" | "end" | "switch" | "case" | "ifdef" | "ifndef" | "elseif" | "endif" => {
            "words have no # here, and a block stands in braces: if x > 1 { ... }"
        }
        "include" | "import" | "pragma" | "version" => "write import \"name\" as name; for a script beside this one",
        _ => return None,
    };
    Some((at, (format!("`#{word}` is not a word of this language"), Some(help.into()))))
}
