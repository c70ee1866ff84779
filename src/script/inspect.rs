//! A look at a script before it runs: what is named nowhere, in branches too that no frame takes, all of it at once.

use std::collections::BTreeSet;

use ::rhai::{AST, ASTNode, Engine, Expr, FnCallExpr, ParseError, ParseErrorType, Position, Stmt, Token};

use super::rewrite::{self, PlacedToken, TextRole};
use super::vocabulary::Vocabulary;
use super::words::{self, Words, plain_name};
use crate::base::limits;
use crate::base::synonyms::by_meaning;

/// Functions and variables that a script uses and nobody has named, and calls with more arguments than anybody means:
/// the engine's search for their function would take seconds.
///
/// What is named once counts everywhere, in modules too: only what is named nowhere is a mistake for certain.
pub fn certain_mistakes(ast: &AST, vocabulary: &mut Vocabulary) -> Vec<(Position, Words)> {
    let mut names = NamesOfScript { declared: std::mem::take(&mut vocabulary.declared), ..NamesOfScript::default() };
    for function in ast.iter_functions() {
        names.variables.extend(function.params.iter().map(|name| name.to_string()));
    }
    ast.walk(&mut |path: &[ASTNode]| {
        match path.last() {
            Some(ASTNode::Stmt(statement)) => names.statement(statement),
            Some(ASTNode::Expr(expression)) => names.expression(expression),
            _ => {}
        }
        true
    });
    names.declared.extend(names.variables.iter().cloned());
    let mut found = Vec::new();
    for (name, at) in &names.called {
        // A variable may hold a closure.
        if !vocabulary.has_function(name) && !names.declared.contains(name) {
            found.push((*at, (format!("there is no function `{name}`"), vocabulary.nearest_function(name))));
        }
    }
    for (name, at) in &names.used {
        if !names.declared.contains(name) {
            found.push((*at, vocabulary.unknown_variable(name)));
        }
    }
    for (name, count, at) in &names.crowded {
        let message = format!("`{name}` is called with {count} arguments, more than {}", limits::SCRIPT_ARGUMENTS);
        found.push((*at, (message, Some("hand over a list".into()))));
    }
    vocabulary.declared = names.declared;
    vocabulary.modules.extend(names.modules);
    vocabulary.variables.extend(names.variables);
    found.sort_by_key(|(at, _)| (at.line(), at.position()));
    found.dedup_by_key(|(at, _)| *at);
    found
}

#[derive(Default)]
struct NamesOfScript {
    declared: BTreeSet<String>,
    /// Those of modules among them.
    modules: BTreeSet<String>,
    /// Those of variables and parameters among them.
    variables: BTreeSet<String>,
    called: Vec<(String, Position)>,
    used: Vec<(String, Position)>,
    /// Calls of too many arguments, and how many.
    crowded: Vec<(String, usize, Position)>,
}

impl NamesOfScript {
    fn statement(&mut self, statement: &Stmt) {
        match statement {
            Stmt::Var(variable, ..) => drop(self.variables.insert(variable.0.name.to_string())),
            Stmt::For(parts, _) => {
                self.variables.insert(parts.0.name.to_string());
                self.variables.extend(parts.1.iter().map(|counter| counter.name.to_string()));
            }
            Stmt::TryCatch(flow, _) => {
                if let Expr::Variable(name, ..) = &flow.expr {
                    self.declared.insert(name.1.to_string());
                }
            }
            Stmt::Import(import, _) => {
                self.declared.insert(import.1.name.to_string());
                self.modules.insert(import.1.name.to_string());
            }
            Stmt::FnCall(call, at) => self.call(call, *at),
            _ => {}
        }
    }

    fn expression(&mut self, expression: &Expr) {
        match expression {
            Expr::FnCall(call, at) | Expr::MethodCall(call, at) => self.call(call, *at),
            // A namespace is that of a module.
            Expr::Variable(variable, _, at) if variable.2.is_empty() => {
                self.used.push((variable.1.to_string(), *at));
            }
            // Closures may be kept in maps and called from there.
            Expr::Property(property, _) => drop(self.declared.insert(property.2.to_string())),
            Expr::Map(map, _) => self.declared.extend(map.0.iter().map(|(key, _)| key.name.to_string())),
            _ => {}
        }
    }

    fn call(&mut self, call: &FnCallExpr, at: Position) {
        let name = plain_name(&call.name);
        if call.args.len() > limits::SCRIPT_ARGUMENTS {
            self.crowded.push((name.to_string(), call.args.len(), at));
        }
        let is_word = name.starts_with(|c: char| c.is_alphabetic() || c == '_') && !name.contains('$');
        let is_own = ["curry", "call", "is_shared", "is_def_var", "is_def_fn", "type_of", "Fn", "eval", "contains"];
        if call.namespace.is_empty() && call.op_token.is_none() && is_word && !is_own.contains(&name) {
            self.called.push((name.to_string(), at));
        }
    }
}

/// Mistakes of grammar in a text that could not be compiled: one for each function, and for what stands outside of all.
///
/// The others are looked for with everything but one function blanked out, so that one mistake hides no other.
pub fn all_mistakes(engine: &Engine, text: &str, first: ParseError) -> Vec<ParseError> {
    let mut found = vec![first];
    let tokens = rewrite::tokens(engine, text);
    let spans = functions(&tokens, text);
    if spans.is_empty() || matches!(tokens.last(), Some((Token::LexError(..), _))) {
        return found;
    }
    let alone = spans.iter().map(|(start, end)| vec![(0, *start), (*end, text.len())]);
    for blanked in [spans.clone()].into_iter().chain(alone).take(LOOKED_AT) {
        let (ast, rewritten) = rewrite::compile(engine, &blank(text, &blanked), TextRole::Script);
        let Err(error) = ast else { continue };
        let at = error.position();
        // Places in what was rewritten are told back here, since every piece was rewritten on its own.
        let (line, column) = rewritten.original(at.line().unwrap_or(1), at.position().unwrap_or(1));
        let at = Position::new(line.min(u16::MAX.into()) as u16, column.min(u16::MAX.into()) as u16);
        if !found.iter().any(|known| known.position().line() == at.line()) {
            found.push(ParseError(error.0, at));
        }
    }
    found.sort_by_key(|error| (error.position().line(), error.position().position()));
    found
}

/// Functions that are looked at one by one: a script of more has other things to mend first.
const LOOKED_AT: usize = 64;

/// Where each function of a script begins and ends, by its braces.
fn functions(tokens: &[PlacedToken], text: &str) -> Vec<(usize, usize)> {
    let starts = rewrite::line_starts(text);
    let mut spans = Vec::new();
    let (mut depth, mut begun) = (0usize, None);
    for (token, at) in tokens {
        match token {
            Token::Fn if depth == 0 && begun.is_none() => begun = Some(rewrite::offset(text, &starts, *at)),
            Token::LeftBrace | Token::MapStart => depth += 1,
            Token::RightBrace => {
                depth = depth.saturating_sub(1);
                if let Some(start) = begun.filter(|_| depth == 0) {
                    spans.push((start, rewrite::offset(text, &starts, *at) + 1));
                    begun = None;
                }
            }
            _ => {}
        }
    }
    spans
}

/// A text with parts of it made blank, which follow each other; lines and columns stay.
fn blank(text: &str, parts: &[(usize, usize)]) -> String {
    let mut parts = parts.iter().peekable();
    let mut is_blank = |i: usize| {
        while parts.next_if(|(_, end)| *end <= i).is_some() {}
        parts.peek().is_some_and(|(start, _)| *start <= i)
    };
    text.char_indices().map(|(i, c)| if is_blank(i) && c != '\n' { ' ' } else { c }).collect()
}

/// Where a missing sign belongs: behind the last token before the place, where that is on an earlier line.
pub fn place_of_missing(engine: &Engine, text: &str, error: &ParseError) -> Option<Position> {
    let ParseErrorType::MissingToken(token, _) = error.err_type() else { return None };
    let at = error.position();
    if ![";", ",", ")", "]"].contains(&token.as_str()) {
        return None;
    }
    let tokens = rewrite::tokens(engine, text);
    let before = |(_, place): &&PlacedToken| (place.line(), place.position()) < (at.line(), at.position());
    let (last, place) = tokens.iter().rfind(before)?;
    // A word of another language is read as a variable, and what follows it comes as a surprise.
    if matches!(last, Token::Identifier(word) if words::foreign(word).is_some()) {
        return Some(*place);
    }
    (place.line() < at.line()).then(|| {
        let width =
            if let Token::StringConstant(s) = last { s.chars().count() + 2 } else { last.to_string().chars().count() };
        let column = place.position().unwrap_or(1) + width.saturating_sub(1);
        Position::new(place.line().unwrap_or(1).min(u16::MAX.into()) as u16, column.min(u16::MAX.into()) as u16)
    })
}

/// The words of a mistake of grammar that is shown at a place in a text.
pub fn words_of(error: &ParseError, at: Position, text: &str, vocabulary: &Vocabulary) -> Words {
    let line = text.lines().nth(at.line().unwrap_or(1) - 1).unwrap_or("");
    let before = at.position().unwrap_or(1).max(1) - 1;
    // What stands behind a dot is the name of a method, whatever it means elsewhere.
    let is_method = before > 0 && line.chars().nth(before - 1) == Some('.');
    let word = line.chars().skip(before).take_while(|c| c.is_alphanumeric() || *c == '_');
    if let ParseErrorType::AssignmentToInvalidLHS(_) = error.err_type() {
        // Something is assigned to what a function gives, which there may not even be.
        let called: String = word.clone().collect();
        let meant = by_meaning(&called, &["get", "material"]).map(|(word, _)| format!("did you mean `{word}`?"));
        if !called.is_empty() && (meant.is_some() || !vocabulary.has_function(&called)) {
            let help = meant.or_else(|| vocabulary.nearest_function(&called));
            return (format!("a scene has no function `{called}`"), help);
        }
    }
    let near: String = word.filter(|_| !is_method).collect();
    words::of_error(&::rhai::EvalAltResult::ErrorParsing((*error.0).clone(), at), &near, vocabulary)
}
